"""The plan of an export: which pictures go where, after a look at every one of them.

Nothing is written.
"""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatchcase
from math import isclose, isfinite
from pathlib import Path
from typing import Any, NamedTuple

from spin_usd import __version__
from spin_usd.basics.arrays import digest
from spin_usd.basics.pluralise import pluralise
from spin_usd.basics.progress import Progress
from spin_usd.basics.suggestion import suggestion
from spin_usd.commands.export.options import ExportOptions
from spin_usd.errors import InputError, UnsupportedError
from spin_usd.exchange.layout.export_format import ExportFormat, Layout
from spin_usd.exchange.layout.exported_dataset import Entry, ExportedDataset, ExportedPicture
from spin_usd.exchange.layout.survey import Survey
from spin_usd.exchange.table import format_named
from spin_usd.formats.chosen_frames import slice_of
from spin_usd.options import names_in
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.splits import pose_bytes, poses_of, split_of_each
from spin_usd.scene.body import OCCLUDER
from spin_usd.scene.poses import FRAME_NAME, FRAME_NAME_RULE, repeated_name
from spin_usd.scene.scene import NOMINAL
from spin_usd.scene.target import MAX_PARTS
from spin_usd.store.tags import TAGS, tagged

WRITE = "write for example train=0.8,validation=0.2"
NAME = re.compile(r"[a-z][a-z0-9_]{0,40}")
DEFAULT = "train"
MAX_NAME = 240  # bytes of a file's name, an ending of its own included, that file systems take


@dataclass(frozen=True, kw_only=True)
class ExportPlan:
    """The contents of an export."""

    format: ExportFormat
    layout: Layout
    exported: ExportedDataset
    survey: Survey
    """Properties of its pictures."""
    left_out: int
    """How many pictures do not show the target, where the format cannot hold those or the target was requested."""
    described: Mapping[str, Any]
    """Contents of export.json."""


def plan_export(request: ExportOptions, *, progress: Progress) -> ExportPlan:
    """Choose the pictures, read all of their records, and refuse content that the format cannot hold.

    Raises InputError and UnsupportedError.
    """
    to = format_named(request.to)
    options = to.values(request.format_options)
    layout = to.layout_for(options)
    shares = named_splits(read_split(request.split), layout.splits, format_name=to.name)
    dataset = Dataset(Path(request.dataset))
    _refuse_parts(dataset)
    chosen = ExportedDataset(
        dataset=dataset,
        entries=_entries(dataset, request, shares, progress),
        splits=tuple(shares),
        target=_target(dataset, request.target),
        options=options,
    )
    occluders = any(part.target == OCCLUDER for part in dataset.parts.values())
    survey = Survey(
        format=to.name, target=chosen.target, parts=len(dataset.parts), targets=dataset.targets, occluders=occluders
    )
    kept, identity = _survey_pictures(chosen, layout, survey, request.target, progress)
    for limit in layout.limits:
        limit(survey)
    described = {
        "format": to.name,
        "options": dict(options),
        "dataset": identity,
        "target": chosen.target,
        "splits": dict(shares),
        "seed": request.seed,
        "pictures": len(kept),
        "spin_usd": __version__,
    }
    exported = replace(chosen, entries=kept, cameras=tuple(survey.cameras), farthest=survey.farthest[0])
    layout.refuse(exported)
    return ExportPlan(
        format=to,
        layout=layout,
        exported=exported,
        survey=survey,
        left_out=len(chosen) - len(kept),
        described=described,
    )


def _entries(
    dataset: Dataset, request: ExportOptions, shares: Mapping[str, float], progress: Progress
) -> tuple[Entry, ...]:
    """Return the pictures chosen, each with its split: all variants of a pose are in one."""
    file = Path(request.tags_file or dataset.root / TAGS)
    wanted = tagged(file, request.tag_names) if request.tag_names else set()
    pictures = selected(dataset, frames=request.frames, variants=names_in(request.variants), progress=progress)
    if request.tag_names:
        pictures = tuple(each for each in pictures if (each.frame, each.variant) in wanted)
        if not pictures:
            found = f"tags no picture of those with {', '.join(request.tag_names)}"
            raise InputError(found, where=file, do="choose other tags, frames or variants")
    pose = poses_of((each.frame, each.pose) for each in pictures)
    split = split_of_each(list(pose.values()), shares, seed=request.seed)
    if empty := next((name for name in shares if name not in split.values()), None):
        found = f"the split {empty} is less than one of {pluralise(len(split), 'pose')}"
        raise InputError(found, do="give it a larger share, or export more pictures")
    return tuple(Entry(each.frame, each.variant, each.name, split[pose[each.frame]]) for each in pictures)


def _survey_pictures(
    chosen: ExportedDataset, layout: Layout, survey: Survey, target: str | None, progress: Progress
) -> tuple[tuple[Entry, ...], str]:
    """Return the pictures that the format holds, for a format of one target those that show the requested one, and a
    digest of all that was read of them. Raises InputError."""
    identity = hashlib.sha256(_digest_of_shared(chosen.dataset).encode())
    kept: list[Entry] = []
    for done, (entry, picture) in enumerate(zip(chosen.entries, chosen, strict=True)):
        progress("checking: picture", done, len(chosen))
        _refuse_missing_kinds(picture, layout, survey.format)
        identity.update(json.dumps(picture.picture.record, sort_keys=True).encode())
        another = not layout.several and target is not None and picture.target.name != target
        if another or (layout.visible_only and not _shows_target(picture, layout)):
            continue
        survey.add(picture)
        kept.append(entry)
    progress("checking: picture", len(chosen), len(chosen))
    if not any(_shows_target(picture, layout) for picture in replace(chosen, entries=kept)):
        do = "check the poses and the camera: spin-usd check"
        raise InputError("shows no pixel of its target in any picture", where=chosen.dataset.root, do=do)
    return tuple(kept), identity.hexdigest()


def _digest_of_shared(dataset: Dataset) -> str:
    """Return a digest of the data common to all pictures."""
    parts = [asdict(part) for part in dataset.parts.values()]
    targets = [[each.name, each.box.tolist(), list(each.keypoints.names)] for each in dataset.targets]
    return digest(parts, targets, *(each.keypoints.points for each in dataset.targets))


def _shows_target(picture: ExportedPicture, layout: Layout) -> bool:
    """Return whether a target that the format holds is visible."""
    targets = picture.targets if layout.several else (picture.target,)
    return any(target.pixels_visible > 0 for target in targets)


def _refuse_missing_kinds(picture: ExportedPicture, layout: Layout, format_name: str) -> None:
    """Raise InputError where the picture lacks a kind of file that the format needs."""
    for kind in layout.needs:
        if not picture.has(kind):
            do = "render it without --labels-only" if kind == "image" else f"render it with --labels default,{kind}"
            raise InputError(f"has no {kind}, which {format_name} needs", where=picture.name, do=do)


def _refuse_parts(dataset: Dataset) -> None:
    """Raise UnsupportedError for more parts than a segmentation can distinguish."""
    if len(dataset.parts) > MAX_PARTS:
        found = f"lists {len(dataset.parts)} parts, and 16 bits of a segmentation hold {MAX_PARTS}"
        raise UnsupportedError(found, where=dataset.root, do="merge parts with author --parts, and render again")


def _target(dataset: Dataset, name: str | None) -> str:
    """Return the name of the target that is exported where a format holds one. Raises InputError."""
    names = [target.name for target in dataset.targets]
    if name is not None and name not in names:
        raise InputError(f"has no target {name!r}", where=dataset.root, do=suggestion(name, names))
    return name or names[0]


def read_split(text: str | None) -> dict[str, float]:
    """Return the share of each split in "train=0.8,validation=0.2"; all is "train" if it is None.

    Raises InputError unless the shares are positive and their sum is 1.
    """
    if text is None:
        return {DEFAULT: 1.0}
    shares: dict[str, float] = {}
    for item in text.split(","):
        name, _, number = (part.strip() for part in item.partition("="))
        if not NAME.fullmatch(name) or name in shares:
            raise InputError(f"split {text!r} has {name!r} as a name", do=f"{WRITE}; small letters, each name once")
        shares[name] = _share(number, text)
    if not isclose(total := sum(shares.values()), 1, abs_tol=1e-9):
        raise InputError(f"the shares of split {text!r} sum up to {total:g}", do=f"make it 1: {WRITE}")
    return shares


def _share(number: str, text: str) -> float:
    try:
        share = float(number)
        if not (isfinite(share) and share > 0):
            raise ValueError
    except ValueError:
        raise InputError(f"split {text!r} has the share {number!r}", do=WRITE) from None
    return share


def named_splits(shares: Mapping[str, float], names: Mapping[str, str] | None, *, format_name: str) -> dict[str, float]:
    """Return the shares by the format's own `names` of splits. Raises InputError for a split that it does not have."""
    if names is None:
        return dict(shares)
    known = {**{own: own for own in names.values()}, **names}
    for split in shares:
        if split not in known:
            do = f"choose among {', '.join(names)}"
            raise InputError(f"{format_name} has no split {split!r}", do=do)
    return {known[split]: share for split, share in shares.items()}


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
    """Return the pictures of these variants (names or patterns; all if none is given) and of the `frames` "A:B:STEP",
    ordered by variant, nominal first, and by place in the stage.

    Raises InputError if there is none, and for a picture that does not match its name.

    A picture has its frame's name; with several variants it is FRAME-VARIANT.
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
    if pair := repeated_name([each.name for each in found]):
        do = "export one variant at a time"
        raise InputError(f"has two pictures that would be called {found[pair[1]].name}", where=dataset.root, do=do)
    return tuple(found)


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
        yield Selected(frame, variant, picture.index, pose_bytes(picture), name)
    progress("reading: picture", len(names), len(names))


def _refuse_bad_name(dataset: Dataset, frame: str, variant: str) -> None:
    if not FRAME_NAME.fullmatch(frame) or not FRAME_NAME.fullmatch(variant):
        raise InputError(f"{frame!r} of {variant!r} cannot name a picture", where=dataset.root, do=FRAME_NAME_RULE)
