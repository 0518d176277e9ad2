"""A folder's files with their digests, listed in the folder itself, so that who replaces it whole can see what in it
is ours. The list is as the program `sha256sum` writes it, and `sha256sum --check` reads it.
"""

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from spin_usd.dataset.store.tree import files
from spin_usd.errors import InputError
from spin_usd.sha256 import sha256_of

SUMS = "SHA256SUMS"
CHANGED = "is not as spin-usd wrote it, and would be replaced"


def write_sums(folder: Path, *, beside: Iterable[Path] = ()) -> None:
    """List the files of the folder, and those `beside` it. Raises OSError."""
    (folder / SUMS).write_text(sums(folder, beside=beside), encoding="utf-8", errors="surrogateescape")


def sums(folder: Path, *, beside: Iterable[Path] = ()) -> str:
    """Return the list of the files as they are now. Raises OSError."""
    return "".join(f"{_line(folder, file)}\n" for file in _files(folder, beside))


def same_files(folder: Path, other: Path) -> bool:
    """Return whether both folders list the same files with the same bytes."""
    with suppress(OSError):
        return (folder / SUMS).read_bytes() == (other / SUMS).read_bytes()
    return False


def refuse_changed(folder: Path) -> None:
    """Raise InputError where the folder holds a file that it does not list, or not with these bytes."""
    for file in changed(folder):
        raise InputError(CHANGED, where=file, do=f"move {folder.name}/ elsewhere")


def changed(folder: Path, *, beside: Iterable[Path] = ()) -> Iterator[Path]:
    """Return the files in the folder, and those `beside` it that are there, which its list does not name, or not with
    these bytes."""
    try:
        text = (folder / SUMS).read_text(encoding="utf-8", errors="surrogateescape")
    except OSError:
        text = ""
    listed = set(text.split("\n"))
    return (file for file in _files(folder, beside) if _line(folder, file) not in listed)


def _files(folder: Path, beside: Iterable[Path]) -> Iterator[Path]:
    yield from (folder / name for name in files(folder) if name != SUMS)
    yield from (file for file in beside if file.is_file())


def _line(folder: Path, file: Path) -> str:
    """Return the file's line of the list, by its name relative to the folder."""
    name = Path(os.path.relpath(file, folder)).as_posix()
    escaped = name.replace("\\", "\\\\").replace("\n", "\\n")
    mark = "\\" if escaped != name else ""
    return f"{mark}{sha256_of(file)}  {escaped}"
