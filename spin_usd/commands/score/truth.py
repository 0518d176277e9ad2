"""The scored pictures, with their true poses and the values that scores are grouped by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path

import numpy as np
from msgspec import UNSET

from spin_usd.basics.arrays import Float
from spin_usd.basics.progress import Progress
from spin_usd.errors import InputError
from spin_usd.exchange.read_pose_list import read_pose_list
from spin_usd.files.folder import Folder
from spin_usd.geometry.rotation import matrices_from_quaternions
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.picture import Picture
from spin_usd.store.names import DESCRIPTION

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
NONE = float("nan")


@dataclass(frozen=True, kw_only=True, eq=False)
class Truth:
    """The true poses of N pictures, from a dataset or a pose list."""

    names: tuple[tuple[str, str], ...]
    """(N): picture and variant, which is "" for a pose list."""
    q: Float
    """(N, 4)."""
    t: Float
    """(N, 3), metres."""
    sun: Float
    """(N,): the angle at the target between the Sun and the camera, degrees; NaN without a Sun."""
    visible: Float
    """(N,): the visible share of the target; NaN if unknown."""
    dataset: Dataset | None = None
    """None for a pose list."""
    target: int | None = None
    """Its id; None for a pose list."""

    @cached_property
    def places(self) -> Mapping[tuple[str, str | None], int]:
        """The place of each picture by its name and variant; without the variant by its name alone, where it has only
        one, and by NAME-VARIANT, as exports name several."""
        found: dict[tuple[str, str | None], int] = {name: place for place, name in enumerate(self.names)}
        several = len({variant for _, variant in self.names}) > 1
        for place, (frame, variant) in enumerate(self.names):
            found[f"{frame}-{variant}" if several else frame, None] = place
        return found

    @property
    def facing(self) -> tuple[str, ...]:
        """Of each picture the axis of the body that points most to the camera."""
        towards = -np.einsum("nji,nj->ni", matrices_from_quaternions(self.q), self.t)
        axis = np.abs(towards).argmax(1)
        back = np.take_along_axis(towards, axis[:, None], 1)[:, 0] < 0
        return tuple(AXES[2 * a + b] for a, b in zip(axis.tolist(), back.tolist(), strict=True))

    def picture(self, place: int) -> Picture | None:
        """Return the picture at that place; None where the truth is a pose list."""
        return self.dataset.picture(*self.names[place]) if self.dataset else None


def read_truth(path: Path, *, variants: Sequence[str], target: str | None, progress: Progress) -> Truth:
    """Read a dataset's pictures of these variants (names or patterns; all where none is given), or a pose list. Raises
    InputError."""
    if path.is_dir() and Folder(path).type_of(DESCRIPTION) is not None:
        return _of_dataset(Dataset(path), variants, target, progress)
    if variants or target:
        raise InputError("is not a dataset, so it has no variants and targets", where=path, do="leave the option out")
    poses = read_pose_list(path)
    unknown = np.full(len(poses.names), NONE)
    names = tuple((name, "") for name in poses.names)
    return Truth(names=names, q=poses.q_cam_body, t=poses.t_cam_body, sun=unknown, visible=unknown)


def _of_dataset(dataset: Dataset, variants: Sequence[str], target: str | None, progress: Progress) -> Truth:
    chosen = [each for each in dataset.variants if _is_of(each, variants)]
    if not chosen:
        do = f"choose among {', '.join(dataset.variants[:10])}" if dataset.variants else "render it first"
        raise InputError(f"has no picture of variant {', '.join(variants) or 'any'}", where=dataset.root, do=do)
    names = tuple(name for name in dataset.names if name[1] in chosen)
    target_id = (dataset.targets[target] if target else dataset.targets[0]).id
    q, t, sun, visible = (np.full((len(names), *shape), NONE) for shape in ((4,), (3,), (), ()))
    for place, name in enumerate(names):
        progress("reading the truth: picture", place, len(names))
        picture = dataset.picture(*name)
        of = picture.targets[target_id - 1]
        q[place], t[place], visible[place] = of.q_cam_body, of.t_cam_body, of.visible_fraction
        if picture.recorded.sun is not UNSET:
            towards = np.array(picture.recorded.sun.towards_cam)
            sun[place] = np.degrees(np.arccos(np.clip(-of.t_cam_body @ towards / of.range, -1, 1)))
    return Truth(names=names, q=q, t=t, sun=sun, visible=visible, dataset=dataset, target=target_id)


def _is_of(variant: str, patterns: Sequence[str]) -> bool:
    return not patterns or any(each == "all" or fnmatchcase(variant, each) for each in patterns)
