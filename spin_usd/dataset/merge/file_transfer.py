"""Files that are taken over from other datasets: every byte verified, linked where that can be, else copied."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from spin_usd.dataset.store.atomic import link_atomically
from spin_usd.dataset.store.tree import file_at
from spin_usd.errors import InputError
from spin_usd.sha256 import sha256_of


class _Placed(NamedTuple):
    path: Path
    sha256: str


@dataclass(kw_only=True)
class FileTransfer:
    """Puts files of other datasets into the folder `out`; `work` is for what is not yet whole. Files that share their
    bytes on disk there, such as the labels of variants, share them in `out` too."""

    out: Path
    work: Path
    copy: bool
    _placed: dict[tuple[int, int], _Placed] = field(default_factory=dict)

    def put(self, root: Path, name: str, sha256: str) -> None:
        """Put the file `name` of the dataset in `root` at the same name. Raises InputError where it does not have that
        sha256, or is no file, and OutputError."""
        source, target = file_at(root, name), self.out / name
        found = source.stat()
        placed = self._placed.get((found.st_dev, found.st_ino))
        if (placed.sha256 if placed else sha256_of(source)) != sha256:
            raise InputError(
                "is not as its record says", where=source, do="run spin-usd render again with --verify there"
            )
        link_atomically(target, placed.path if placed else source, work=self.work, copy=self.copy and placed is None)
        if found.st_nlink > 1 and placed is None:
            self._placed[found.st_dev, found.st_ino] = _Placed(target, sha256)

    def put_record(self, root: Path, name: str) -> None:
        """Put the record `name` of the dataset in `root`, which nothing lists with its bytes. Raises as `put` does."""
        link_atomically(self.out / name, file_at(root, name), work=self.work, copy=self.copy)
