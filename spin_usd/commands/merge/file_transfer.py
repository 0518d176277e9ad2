"""Files from other datasets: every byte verified, linked if possible, else copied."""

from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote
from typing import NamedTuple

from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn, Folder
from spin_usd.store.atomic import link_atomically


def repair_of(root: Path) -> str:
    """Return the remedy for the dataset in the folder `root`."""
    return f"run spin-usd check --repair {quote(str(root))}"


class _Placed(NamedTuple):
    file: FileIn
    sha256: str


@dataclass(kw_only=True)
class FileTransfer:
    """Puts files of other datasets into the folder `out`; `work` is for unfinished files. Files that share their bytes
    on disk there, such as the labels of variants, share them in `out` too."""

    out: Path
    work: Path
    copy: bool
    _placed: dict[tuple[int, int], _Placed] = field(default_factory=dict)

    def put(self, root: Path, name: str, sha256: str) -> None:
        """Put the file `name` of the dataset in `root` at the same name. Raises InputError if it does not have that
        sha256, or is not a file, and OutputError."""
        folder, out = Folder(root), Folder(self.out)
        inode = folder.inode(name)
        placed = self._placed.get(inode)
        if (placed.sha256 if placed else folder.sha256(name)) != sha256:
            raise InputError("does not match its record", where=root / name, do=repair_of(root))
        source = placed.file if placed else FileIn(folder, name)
        link_atomically(out, name, source, work=self.work, copy=self.copy and placed is None)
        if placed is None and folder.has_other_names(name):
            self._placed[inode] = _Placed(FileIn(out, name), sha256)

    def put_record(self, root: Path, name: str) -> None:
        """Put the record `name` of the dataset in `root`, which nothing lists with its bytes. Raises as `put` does."""
        link_atomically(Folder(self.out), name, FileIn(Folder(root), name), work=self.work, copy=self.copy)
