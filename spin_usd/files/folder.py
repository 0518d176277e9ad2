"""The contents of a folder, reached from its descriptor, part by part, following no link.

The folder's own path is a user's and may be a link. The names below it come from data, or from the disk. If the system
cannot open relative to a folder (Windows), each part of a path is checked before the whole is opened: a link created in
between is followed.
"""

import errno
import hashlib
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import BufferedReader
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple, Self

from spin_usd.errors import InputError
from spin_usd.files.descriptor import FLAGS, read_all, to_read
from spin_usd.files.name import parts_of
from spin_usd.files.node import STRANGE, Node, NodeType, type_of_entry, type_of_mode
from spin_usd.files.size_limits import UNBOUNDED

MAX_DEPTH = 100  # of folders in one another: a list of more is of no use, and takes a descriptor for each
FOLDER_FLAGS = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_CLOEXEC", 0)
NO_LINK = getattr(os, "O_NOFOLLOW", 0)
BY_DESCRIPTOR = os.open in os.supports_dir_fd


@dataclass(frozen=True)
class Folder:
    """The folder `root` and its contents. Names are relative to it, with slashes. A file that cannot be opened, is
    larger than allowed, or is reached over a link, is an InputError with its place."""

    root: Path

    def type_of(self, name: str) -> NodeType | None:
        """Return the type of the entry of that name; None if it does not exist."""
        *folders, last = parts_of(name, self.root)
        try:
            with Holder.of(self.root, folders) as holder:
                return type_of_mode(holder.mode(last))
        except OSError:
            return None

    def open(self, name: str, max_bytes: int) -> BufferedReader:
        """Open the file `name`, of at most `max_bytes`, to read it."""
        return os.fdopen(self._opened(name, max_bytes), "rb")

    def read(self, name: str, max_bytes: int) -> bytes:
        """Read all of the file `name`, of at most `max_bytes`."""
        descriptor = self._opened(name, max_bytes)
        try:
            return read_all(descriptor, self.root / name)
        finally:
            os.close(descriptor)

    def sha256(self, name: str) -> str:
        """Return the sha256 (hex) of the bytes in the file `name`."""
        with self.open(name, UNBOUNDED) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    def inode(self, name: str) -> tuple[int, int]:
        """Return (device, number) of the file `name`, which are the same for each of its names."""
        status = self._status(name)
        return status.st_dev, status.st_ino

    def has_other_names(self, name: str) -> bool:
        """Return whether the file `name` has other names too: hard links."""
        return self._status(name).st_nlink > 1

    def size(self, name: str) -> int:
        """Return how many bytes the file `name` has."""
        return self._status(name).st_size

    def _status(self, name: str) -> os.stat_result:
        with self.open(name, UNBOUNDED) as file:
            return os.fstat(file.fileno())

    def path(self, name: str) -> Path:
        """Return the path of the file `name`, for programs that open files by their paths; it is one now."""
        os.close(self._opened(name, UNBOUNDED))
        return self.root / name

    def walk(self, within: str = "") -> Iterator[Node]:
        """Yield the contents of the folder `within`, ordered by name; nothing if there is no such folder."""
        folders = parts_of(within, self.root) if within else []
        try:
            holder = Holder.of(self.root, folders)
        except OSError:
            return
        yield from self._walk(holder, within, len(folders))

    def files(self, within: str = "") -> Iterator[str]:
        """Yield the names of the files among them."""
        return (node.name for node in self.walk(within) if node.type is NodeType.FILE)

    def special_files(self, names: Iterable[str]) -> Iterator[Node]:
        """Yield entries of these names, and below them, that are neither file nor folder."""
        for name in names:
            own = self.type_of(name)
            nodes = [Node(name, own)] if own else []
            yield from (node for node in (*nodes, *self.walk(name)) if node.type in STRANGE)

    def in_the_way(self, name: str) -> Node | None:
        """Return the link, pipe, socket or device that has that name, or lies on the way there; None without one."""
        parts = parts_of(name, self.root)
        for place in ("/".join(parts[:end]) for end in range(1, len(parts) + 1)):
            type = self.type_of(place)
            if type in STRANGE:
                return Node(place, type)
        return None

    def _opened(self, name: str, max_bytes: int) -> int:
        *folders, last = parts_of(name, self.root)
        try:
            with Holder.of(self.root, folders) as holder:
                descriptor = holder.open(last)
        except FileNotFoundError:
            do = "restore it, or run spin-usd render again with --verify"
            raise InputError("is missing", where=self.root / name, do=do) from None
        except OSError as error:
            found = f"is not a file, or is reached over a link ({error.strerror})"
            raise InputError(found, where=self.root / name, do="put the file itself there") from None
        return to_read(descriptor, max_bytes, self.root / name)

    def _walk(self, folder: "Holder", within: str, depth: int) -> Iterator[Node]:
        """Yield the contents of the open folder, which is closed in the end."""
        before = f"{within}/" if within else ""
        with folder as holder:
            for last, type in self._entries(holder, within):
                name = before + last
                yield Node(name, type)
                if type is NodeType.FOLDER:
                    yield from self._walk(self._inner(holder, last, name, depth), name, depth + 1)

    def _entries(self, holder: "Holder", within: str) -> list[tuple[str, NodeType]]:
        try:
            with os.scandir(holder.at) as found:
                return sorted(((entry.name, type_of_entry(entry)) for entry in found), key=itemgetter(0))
        except OSError as error:
            raise self._unreadable(within, error.strerror) from None

    def _inner(self, holder: "Holder", last: str, name: str, depth: int) -> "Holder":
        if depth >= MAX_DEPTH:
            raise self._unreadable(name, f"more than {MAX_DEPTH} folders in one another")
        try:
            return holder.inner(last)
        except OSError as error:
            raise self._unreadable(name, error.strerror) from None

    def _unreadable(self, name: str, reason: str | None) -> InputError:
        return InputError(f"cannot be read ({reason})", where=self.root / name, do="inspect it")


class FileIn(NamedTuple):
    """A file by its name in a folder."""

    folder: Folder
    name: str

    @property
    def path(self) -> Path:
        """Where it lies, for messages."""
        return self.folder.root / self.name

    def open(self) -> BufferedReader:
        """Open the file to read it piece by piece."""
        return self.folder.open(self.name, UNBOUNDED)


@dataclass(frozen=True)
class Holder:
    """An open folder, closed by `with`."""

    at: int | Path
    """Its descriptor; its path where the system opens nothing relative to one."""

    @classmethod
    def of(cls, root: Path, folders: Sequence[str]) -> "Holder":
        """Open the folder to which `folders` lead from `root`, over no link. Raises OSError."""
        if BY_DESCRIPTOR:
            return cls(descend(root, folders))
        holder = cls(root)
        for folder in folders:
            holder = holder.inner(folder)
        return holder

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if isinstance(self.at, int):
            os.close(self.at)

    def mode(self, last: str) -> int:
        """Return the mode of the entry of that name in the folder, of a link itself. Raises OSError."""
        if isinstance(self.at, int):
            return os.stat(last, dir_fd=self.at, follow_symlinks=False).st_mode
        return os.lstat(self._path(self.at, last)).st_mode

    def open(self, last: str) -> int:
        """Open the file of that name in the folder, but not a link. Raises OSError."""
        if isinstance(self.at, int):
            return os.open(last, FLAGS | NO_LINK, dir_fd=self.at)
        if stat.S_ISLNK(self.mode(last)):
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        return os.open(self._path(self.at, last), FLAGS)

    def inner(self, last: str) -> "Holder":
        """Open the folder of that name in the folder, but not a link. Raises OSError."""
        if isinstance(self.at, int):
            return Holder(os.open(last, FOLDER_FLAGS | NO_LINK, dir_fd=self.at))
        if not stat.S_ISDIR(self.mode(last)):
            raise OSError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
        return Holder(self._path(self.at, last))

    @staticmethod
    def _path(folder: Path, last: str) -> Path:
        """Return the path of the entry of that name in the folder; a name that leads elsewhere, such as one with a
        backslash on Windows, is invalid. Raises OSError."""
        if os.path.basename(last) != last or os.path.splitdrive(last)[0]:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), last)
        return folder / last


def descend(root: Path, folders: Sequence[str]) -> int:
    """Open the folder to which `folders` lead from `root`, over no link. Raises OSError."""
    descriptor = os.open(root, FOLDER_FLAGS)
    for folder in folders:
        try:
            inner = os.open(folder, FOLDER_FLAGS | NO_LINK, dir_fd=descriptor)
        finally:
            os.close(descriptor)
        descriptor = inner
    return descriptor
