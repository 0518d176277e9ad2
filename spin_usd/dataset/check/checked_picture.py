"""A picture of a dataset as the rules of `check` see it, and what all of a dataset's pictures share."""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from numpy.typing import NDArray

from spin_usd.dataset.store.cache import Purpose
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.formats.arrays.array_file import read_array
from spin_usd.scene.finding import Finding
from spin_usd.sha256 import sha256_of

MAKE_AGAIN = "remove its record and run spin-usd render again"


@dataclass(kw_only=True)
class Inventory:
    """The contents of the whole dataset, as `check` has seen them so far.

    description: its dataset.json · present: names of the files that are there · the others are of the records seen so
    far: the files that they list, what they use of the cache, the inodes (device, number) of files that were verified,
    and the layers that were.
    """

    description: Mapping[str, Any]
    present: Set[str]
    files: set[str] = field(default_factory=set)
    uses: set[Purpose] = field(default_factory=set)
    inodes: set[tuple[int, int]] = field(default_factory=set)
    layers: set[tuple[str, str]] = field(default_factory=set)


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedPicture:
    """A picture whose record is valid.

    store: the dataset · where: the record's path in it, for findings · record: as schema record-1 says · intact:
    whether each of its files is there with the bytes that the record says · inventory: of the dataset.
    """

    store: Store
    where: str
    record: Mapping[str, Any]
    intact: bool
    inventory: Inventory

    @cached_property
    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """The numbers of each of its files by kind: (H, W) or (H, W, C) pixels, or (N,) points of a LiDAR; none unless
        all are intact."""
        if not self.intact:
            return {}
        return {kind: read_array(self.store.root / entry["path"]) for kind, entry in self.record["files"].items()}


def digest_findings(store: Store, name: str, sha256: str, inventory: Inventory) -> Iterator[Finding]:
    """Find whether the dataset's file `name` is missing, or has other bytes than its record says."""
    if name not in inventory.present:
        yield Finding(code="missing", where=name, message=f"the file is missing; {MAKE_AGAIN}")
    elif sha256_of(store.root / name) != sha256:
        yield Finding(code="sha256", where=name, message=f"differs from its record; {MAKE_AGAIN}")
