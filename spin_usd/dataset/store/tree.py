"""The files and folders below a folder, none of them reached over a link."""

import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import suppress
from enum import StrEnum
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from spin_usd.errors import InputError, OutputError


class NodeType(StrEnum):
    """The type of a node itself: a link is a link wherever it leads."""

    FILE = "file"
    FOLDER = "folder"
    LINK = "link"
    OTHER = "pipe, socket or device"


STRANGE = (NodeType.LINK, NodeType.OTHER)


class Node(NamedTuple):
    """Something below a folder: its name relative to that, with slashes, and what it is."""

    name: str
    type: NodeType


def type_of(path: Path) -> NodeType | None:
    """Return the type of what is at `path`; None where nothing is."""
    try:
        mode = path.lstat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None
    types = {stat.S_IFREG: NodeType.FILE, stat.S_IFDIR: NodeType.FOLDER, stat.S_IFLNK: NodeType.LINK}
    return types.get(stat.S_IFMT(mode), NodeType.OTHER)


def walk(root: Path, within: str = "") -> Iterator[Node]:
    """Yield all that lies below the folder `within` of `root`, ordered by name; nothing where there is no such folder,
    or a link leads there from `root`, which may be one itself. Raises InputError for a folder that cannot be read."""
    if root.is_dir() and all(type_of(folder) is NodeType.FOLDER for folder in _folders(root, within)):
        yield from _walk(str(root), within)


def files(root: Path, within: str = "") -> Iterator[str]:
    """Yield the names of the files among them."""
    return (node.name for node in walk(root, within) if node.type is NodeType.FILE)


def strange(root: Path, names: Iterable[str]) -> Iterator[Node]:
    """Yield what is neither file nor folder, of `root`'s own files and folders of these names and of all below them."""
    for name in names:
        own = type_of(root / name)
        nodes = [Node(name, own)] if own else []
        yield from (node for node in (*nodes, *walk(root, name)) if node.type in STRANGE)


def file_at(root: Path, name: str) -> Path:
    """Return the file `name` below `root`. Raises InputError where that is not a file, lies elsewhere, or is reached
    over a link."""
    pure, path = PurePosixPath(name), root / name
    if pure.is_absolute() or ".." in pure.parts:
        raise InputError("lies outside the folder", where=path, do="run spin-usd check on the dataset")
    if (
        all(type_of(folder) is NodeType.FOLDER for folder in _folders(root, name)[:-1])
        and type_of(path) is NodeType.FILE
    ):
        return path
    if type_of(path) is None:
        raise InputError("is missing", where=path, do="restore it, or run spin-usd render again with --verify")
    raise InputError("is not a file, or is reached over a link", where=path, do="put the file itself there")


def remove_file(root: Path, name: str) -> None:
    """Remove the file `name` below `root`, if there is one. Raises OutputError where that cannot be done, and
    InputError where something else is there, or a link leads there."""
    if type_of(root / name) is None:
        return
    path = file_at(root, name)
    try:
        path.unlink(missing_ok=True)
    except OSError as e:
        raise OutputError(f"cannot be removed ({e.strerror})", where=path, do="make it writable, and try again") from e


def remove_emptied(root: Path, name: str) -> None:
    """Remove the folders that lead to `name` below `root`, from the innermost, as far as they are empty."""
    with suppress(OSError):  # not empty
        for folder in reversed(_folders(root, name)[:-1]):
            folder.rmdir()


def _folders(root: Path, within: str) -> list[Path]:
    """Return each folder on the way from `root` to `within`, that included."""
    parts = PurePosixPath(within).parts
    return [root.joinpath(*parts[: count + 1]) for count in range(len(parts))]


def _walk(root: str, within: str) -> Iterator[Node]:
    """Walk over paths as text: a dataset has hundreds of thousands of files, and objects take most of the time."""
    try:
        with os.scandir(f"{root}/{within}") as found:
            entries = sorted(found, key=lambda entry: entry.name)
    except OSError as e:
        raise InputError(f"cannot be read ({e.strerror})", where=f"{root}/{within}") from e
    for entry in entries:
        name = f"{within}/{entry.name}" if within else entry.name
        node = Node(name, _type(entry))
        yield node
        if node.type is NodeType.FOLDER:
            yield from _walk(root, name)


def _type(entry: os.DirEntry[str]) -> NodeType:
    if entry.is_symlink():
        return NodeType.LINK
    if entry.is_dir(follow_symlinks=False):
        return NodeType.FOLDER
    return NodeType.FILE if entry.is_file(follow_symlinks=False) else NodeType.OTHER
