"""The contents of a whole dataset, as seen by `check` so far."""

from collections.abc import Set
from dataclasses import dataclass, field
from pathlib import Path

from spin_usd.files.folder import Folder
from spin_usd.records.descriptions import DatasetDescription
from spin_usd.store.cache import Purpose


@dataclass(kw_only=True)
class Inventory:
    """The contents of the dataset in the folder `root`, which grow with each record that is seen."""

    root: Path
    description: DatasetDescription | None
    """Its dataset.json, None if unusable."""
    present: Set[str]
    """Names of existing files."""
    unread: set[str] = field(default_factory=set)
    """Records that cannot be used."""
    files: set[str] = field(default_factory=set)
    """The files that the other records list."""
    uses: set[Purpose] = field(default_factory=set)
    """Cache entries that these records use."""
    inodes: set[tuple[int, int]] = field(default_factory=set)
    """Device and number of each file that was verified."""
    layers: dict[tuple[str, str], bool] = field(default_factory=dict)
    """Whether the stage has a layer, by its name and sha256."""
    missing: set[str] = field(default_factory=set)
    """Names of missing files of the stage, which have a finding."""

    def add(self, files: list[str], uses: list[Purpose]) -> None:
        """Add a record's contents: its `files`, which were verified, and its `uses` of the cache."""
        self.files.update(files)
        self.uses.update(uses)
        self.inodes.update(Folder(self.root).inode(name) for name in files if name in self.present)
