"""A folder's files with their digests, listed in the folder itself, so that who replaces it whole can tell what in it
is ours. The list is as the program `sha256sum` writes it, and `sha256sum --check` reads it.
"""

from collections.abc import Iterator
from pathlib import Path

from spin_usd.dataset.atomic import sha256_of
from spin_usd.dataset.tree import files
from spin_usd.errors import InputError

SUMS = "SHA256SUMS"


def write_sums(folder: Path) -> None:
    """List the files of the folder. Raises OSError."""
    text = "".join(f"{line}\n" for line in _lines(folder))
    (folder / SUMS).write_text(text, encoding="utf-8", errors="surrogateescape")


def refuse_changed(folder: Path) -> None:
    """Raise InputError where the folder holds a file that it does not list, or not with these bytes."""
    try:
        text = (folder / SUMS).read_text(encoding="utf-8", errors="surrogateescape")
    except OSError:
        text = ""
    listed = set(text.split("\n"))
    for line in _lines(folder):
        if line not in listed:
            found = "is not as spin-usd wrote it, and would be replaced"
            raise InputError(found, where=folder / line.partition("  ")[2], do=f"move {folder.name}/ elsewhere")


def _lines(folder: Path) -> Iterator[str]:
    for name in files(folder):
        if name != SUMS:
            escaped = name.replace("\\", "\\\\").replace("\n", "\\n")
            yield f"{'\\' if escaped != name else ''}{sha256_of(folder / name)}  {escaped}"
