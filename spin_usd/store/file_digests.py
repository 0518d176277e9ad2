"""A folder's files with their digests, listed in the folder itself, so that code that replaces the folder can recognise
our files.

The list has the format of `sha256sum`, and `sha256sum --check` reads it.
"""

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.files.changes import write_bytes
from spin_usd.files.folder import Folder
from spin_usd.files.node import NodeType
from spin_usd.files.size_limits import MAX_DOCUMENT

SUMS = "SHA256SUMS"
CHANGED = "is not as spin-usd wrote it, and would be replaced"
LINE = re.compile(r"\\?[0-9a-f]{64}  .+")


def write_sums(folder: Path, *, beside: Iterable[str] = ()) -> None:
    """List the files of the folder, and files of these names `beside` it. Raises OSError."""
    write_bytes(Folder(folder), SUMS, sums(folder, beside=beside).encode("utf-8", "surrogateescape"))


def sums(folder: Path, *, beside: Iterable[str] = ()) -> str:
    """Return the list of the current files. Raises InputError."""
    return "".join(f"{line}\n" for _, line in _lines(folder, beside))


def same_files(folder: Path, other: Path) -> bool:
    """Return whether both folders list the same files with the same bytes."""
    with suppress(InputError):
        return Folder(folder).read(SUMS, MAX_DOCUMENT) == Folder(other).read(SUMS, MAX_DOCUMENT)
    return False


def same_names(folder: Path, other: Path) -> bool:
    """Return whether both folders contain files of the same names, regardless of their lists."""
    return set(Folder(folder).files()) == set(Folder(other).files())


def changed(folder: Path, *, beside: Iterable[str] = ()) -> Iterator[Path]:
    """Return the files in the folder, and existing files of these names `beside` it, that its list lacks, or has with
    other bytes; also the list itself if it is not valid."""
    if Folder(folder).type_of(SUMS) is NodeType.FILE and not has_list(folder):
        return iter([folder / SUMS])
    return unlisted(folder, beside=beside)


def unlisted(folder: Path, *, beside: Iterable[str] = ()) -> Iterator[Path]:
    """Return the files whose line is not in the list."""
    listed = set(_listed(folder))
    return (file for file, line in _lines(folder, beside) if line not in listed)


def has_list(folder: Path) -> bool:
    """Return whether the folder has a list that is whole: each line is one of a list."""
    lines = _listed(folder)
    return bool(lines) and all(map(LINE.fullmatch, lines))


def _listed(folder: Path) -> list[str]:
    with suppress(InputError):
        return Folder(folder).read(SUMS, MAX_DOCUMENT).decode("utf-8", "surrogateescape").removesuffix("\n").split("\n")
    return []


def _lines(folder: Path, beside: Iterable[str]) -> Iterator[tuple[Path, str]]:
    """Yield each file, and its line of the list, by its name relative to the folder."""
    inside, outside = Folder(folder), Folder(folder.parent)
    yield from ((folder / name, _line(name, inside.sha256(name))) for name in inside.files() if name != SUMS)
    for name in beside:
        if outside.type_of(name) is NodeType.FILE:
            yield folder.parent / name, _line(f"../{name}", outside.sha256(name))


def _line(name: str, sha256: str) -> str:
    escaped = name.replace("\\", "\\\\").replace("\n", "\\n")
    mark = "\\" if escaped != name else ""
    return f"{mark}{sha256}  {escaped}"
