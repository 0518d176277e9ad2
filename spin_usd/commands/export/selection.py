"""Which pictures of a dataset are exported, in which order, and under which names."""

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from spin_usd.errors import InputError
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.progress import Progress
from spin_usd.scene.model import NOMINAL
from spin_usd.scene.poses import FRAME_NAME, FRAME_NAME_RULE
from spin_usd.store.dataset import Dataset
from spin_usd.store.picture import Picture

MAX_NAME = 240  # bytes of a file's name, an ending of its own included, that file systems take


class Selected(NamedTuple):
    """A picture: frame and variant, its place in the stage, the numbers of its pose, and the name that it gets."""

    frame: str
    variant: str
    place: int
    pose: bytes
    name: str


def selected(
    dataset: Dataset, *, frames: str | None, variants: Sequence[str], progress: Progress
) -> tuple[Selected, ...]:
    """Return the pictures of these variants (names or patterns; all where none is given) and of the `frames`
    "A:B:STEP", ordered by variant, nominal first, and by place in the stage.

    Raises InputError where there is none, and for a picture that is not what its name says.

    A picture is called after its frame; where several variants are exported FRAME-VARIANT. No variant has a "-" in its
    name, so no two pictures have the same.
    """
    chosen = _variants(dataset, variants)
    names = [name for name in dataset.names if name[1] in chosen]
    found = sorted(_read(dataset, names, several=len(chosen) > 1, progress=progress), key=_order)
    places = sorted({each.place for each in found})
    if frames is not None:
        kept = set(places[slice_of(frames)])
        found = [each for each in found if each.place in kept]
    if not found:
        raise InputError("has no picture to export", where=dataset.root, do="render it first, or choose other frames")
    return tuple(found)


def poses_of(pictures: Sequence[Selected]) -> dict[str, str]:
    """Return for each frame the first frame that has its pose, mostly itself: a pose may stand twice in a list."""
    pose_of = {each.frame: each.pose for each in reversed(pictures)}
    first = {each.pose: each.frame for each in reversed(pictures)}
    return {frame: first[pose] for frame, pose in pose_of.items()}


def _order(picture: Selected) -> tuple[bool, str, int]:
    return picture.variant != NOMINAL, picture.variant, picture.place


def _variants(dataset: Dataset, patterns: Sequence[str]) -> set[str]:
    found: set[str] = set()
    for pattern in patterns or ("all",):
        of = {name for name in dataset.variants if pattern == "all" or fnmatchcase(name, pattern)}
        if not of and dataset.variants:
            do = f"choose among {', '.join(dataset.variants[:10])}"
            raise InputError(f"has no variant {pattern!r}", where=dataset.root, do=do)
        found |= of
    return found


def _read(
    dataset: Dataset, names: Sequence[tuple[str, str]], *, several: bool, progress: Progress
) -> Iterator[Selected]:
    for done, (frame, variant) in enumerate(names):
        progress("reading: picture", done, len(names))
        _refuse_bad_name(dataset, frame, variant)
        picture = dataset.picture(frame, variant)
        if (picture.frame, picture.variant) != (frame, variant):
            found = f"calls itself {picture.frame!r} of {picture.variant!r}"
            raise InputError(found, where=f"{dataset.root}: {frame} of {variant}", do="run spin-usd check on it")
        name = f"{frame}-{variant}" if several else frame
        if len(name) > MAX_NAME:
            raise InputError("is too long for a file's name", where=name, do="export one variant at a time")
        yield Selected(frame, variant, picture.index, _pose(picture), name)
    progress("reading: picture", len(names), len(names))


def _pose(picture: Picture) -> bytes:
    return picture.q_cam_body.tobytes() + picture.t_cam_body.tobytes()


def _refuse_bad_name(dataset: Dataset, frame: str, variant: str) -> None:
    if not FRAME_NAME.fullmatch(frame) or not FRAME_NAME.fullmatch(variant):
        raise InputError(f"{frame!r} of {variant!r} cannot name a picture", where=dataset.root, do=FRAME_NAME_RULE)
