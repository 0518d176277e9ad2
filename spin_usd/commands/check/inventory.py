"""The contents of a whole dataset, as `check` has seen them so far."""

from collections.abc import Set
from dataclasses import dataclass, field
from pathlib import Path

from spin_usd.files.folder import Folder
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.store.cache import Purpose


@dataclass(kw_only=True)
class Inventory:
    """The contents of the dataset in the folder `root`.

    description: its dataset.json, None where that cannot be used · present: names of the files that are there · the
    others are of the records seen so far: those that cannot be used, the files that the others list, what they use of
    the cache, the inodes (device, number) of files that were verified, the layers by name and sha256, with whether they
    have that, and the names of what is missing of the stage, which has a finding.
    """

    root: Path
    description: DatasetDescription | None
    present: Set[str]
    unread: set[str] = field(default_factory=set)
    files: set[str] = field(default_factory=set)
    uses: set[Purpose] = field(default_factory=set)
    inodes: set[tuple[int, int]] = field(default_factory=set)
    layers: dict[tuple[str, str], bool] = field(default_factory=dict)
    missing: set[str] = field(default_factory=set)

    def add(self, files: list[str], uses: list[Purpose]) -> None:
        """Take in what a record lists: its `files`, which were verified, and its `uses` of the cache."""
        self.files.update(files)
        self.uses.update(uses)
        self.inodes.update(Folder(self.root).inode(name) for name in files if name in self.present)
