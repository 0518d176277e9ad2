"""The description that all pictures of a dataset share, from its dataset.json."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, SupportsIndex, TypeVar, overload

import numpy as np

from spin_usd.basics.arrays import Float, finite
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.records.descriptions import PartEntry, TargetEntry
from spin_usd.scene.keypoints import Keypoints
from spin_usd.store.names import DESCRIPTION
from spin_usd.store.read_documents import read_dataset_json


class Named(Protocol):
    """An object with an id and a name."""

    @property
    def id(self) -> int: ...

    @property
    def name(self) -> str: ...


N = TypeVar("N", bound=Named)


class Targets(tuple[N, ...]):
    """Targets in order of their ids: targets[0] is the first, targets["tango"] the one of that name."""

    __slots__ = ()

    @overload
    def __getitem__(self, key: SupportsIndex | str, /) -> N: ...

    @overload
    def __getitem__(self, key: slice, /) -> tuple[N, ...]: ...

    def __getitem__(self, key: SupportsIndex | str | slice, /) -> N | tuple[N, ...]:
        """Return the target of a place, or of a name. Raises InputError for a name that none has, or several have."""
        if not isinstance(key, str):
            return super().__getitem__(key)
        found = [target for target in self if target.name == key]
        if len(found) != 1:
            have = "several targets are" if found else "no target is"
            known = ", ".join(f"{target.id} {target.name!r}" for target in self)
            raise InputError(f"{have} named {key!r}", do=f"choose among {known}; places count from 0")
        return found[0]


@dataclass(frozen=True, kw_only=True)
class DescribedPart:
    """A part of a body."""

    id: int
    """Its number in the segmentation."""
    path: str
    """Path of its prim."""
    name: str
    """Name in the stage."""
    class_name: str
    """Class of the part."""
    target: int
    """The id of the target it is a part of, 0 of an occluder."""
    materials: tuple[str, ...] = ()
    """The names of its materials in the first picture of the stage without a variant."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DescribedTarget:
    """A target of the dataset."""

    id: int
    """Its number in the label `instance`, from 1."""
    name: str
    """Name in the stage."""
    path: str
    """Path of its prim."""
    size: Float
    """(3,): edges of its bounding box along its own axes, metres."""
    box: Float
    """(2, 3): least and largest coordinates in these axes, metres."""
    keypoints: Keypoints
    """Its named points in these axes, metres."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        for array in (self.size, self.box, self.keypoints.points):
            array.flags.writeable = False  # numpy forgets it on the way


@dataclass(frozen=True, kw_only=True, eq=False)
class Description:
    """The bodies in dataset.json."""

    targets: Targets[DescribedTarget]
    """In order of their ids, also by their names."""
    parts: Mapping[int, DescribedPart]
    """Parts of all bodies, by their ids, the numbers in the segmentation."""

    def target(self, target: int | str) -> DescribedTarget:
        """Return the target of that id or name. Raises InputError if there is none."""
        if isinstance(target, str):
            return self.targets[target]
        for each in self.targets:
            if each.id == target:
                return each
        known = ", ".join(f"{each.id} {each.name!r}" for each in self.targets)
        raise InputError(f"there is no target {target!r}", do=f"choose among {known}")


def read_description(root: Path) -> Description:
    """Read the description of the dataset in the folder `root`. Raises InputError if it is missing or invalid."""
    if os.path.isfile(root):
        raise InputError("is a file", where=root, do="give its folder")
    folder = Folder(root)
    if folder.type_of(DESCRIPTION) is None:
        do = "give the folder that spin-usd render made"
        raise InputError(f"is not a dataset: it has no {DESCRIPTION}", where=root, do=do)
    found = read_dataset_json(folder)
    return described(found.targets, found.parts)


def described(targets: Iterable[TargetEntry], parts: Mapping[str, PartEntry]) -> Description:
    """Return the description in the entries of a dataset.json."""
    each = (_part(int(number), part) for number, part in parts.items())
    return Description(targets=Targets(map(_target, targets)), parts={part.id: part for part in each})


def _part(number: int, found: PartEntry) -> DescribedPart:
    return DescribedPart(
        id=number,
        path=found.path,
        name=found.name,
        class_name=found.class_,
        target=found.target,
        materials=tuple(found.materials),
    )


def _target(found: TargetEntry) -> DescribedTarget:
    names, points = tuple(found.keypoints), np.reshape(list(found.keypoints.values()), (-1, 3))
    return DescribedTarget(
        id=found.id,
        name=found.name,
        path=found.path,
        size=finite(found.size, (3,), "size"),
        box=finite(found.box, (2, 3), "box"),
        keypoints=Keypoints(names=names, points=finite(points, (len(names), 3), "keypoints")),
    )
