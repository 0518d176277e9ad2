"""Files that are complete or absent: written in a run's work folder, then put into place.

Every `work` is the run's own folder, on the same file system as the written files.
"""

import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from pathlib import Path, PurePosixPath
from typing import Any

from spin_usd.errors import OutputError, SpinError
from spin_usd.files.changes import link, put
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.new_file import write_whole

PROCESS = secrets.token_hex(8)  # in the names of this process's temporary files, to distinguish processes
NUMBERS = count()


def write_atomically(
    folder: Folder,
    name: str,
    encode: Callable[[], bytes],
    *,
    work: Path,
    place: Callable[[str], str] | None = None,
    also: str | None = None,
    forced: bool = True,
) -> str:
    """Write the bytes that `encode` returns into the file `name` of the folder, and return their sha256 (hex).

    Raises OutputError, or the SpinError that `encode` raises, leaving nothing, or the file without its second name.

    Args:
        place: Gives the file's name from the sha256, instead of `name`.
        also: A second name of the file, or of a copy if the file system has no links.
        forced: Whether the bytes are on the disk before the file is in its place; else a power cut may truncate
            it.
    """
    temporary, second = _temporary(work, name), _temporary(work, name) if also else None
    with _named(folder.root / name, temporary, second):
        data = encode()
        digest = hashlib.sha256(data).hexdigest()
        _create(temporary, data, forced=forced)
        if second is not None and not _linked(temporary, second):
            _create(second, data, forced=forced)
        put(folder, temporary, place(digest) if place else name)
        if second is not None and also is not None:
            put(folder, second, also)
    return digest


def fill_atomically(folder: Folder, name: str, fill: Callable[[Path], None], *, work: Path) -> None:
    """Let `fill` write a file by its path, force it to disk, and make it the file `name` of the folder. Raises
    OutputError, or the SpinError that `fill` raises, leaving nothing."""
    temporary = _temporary(work, name)
    with _named(folder.root / name, temporary):
        work.mkdir(parents=True, exist_ok=True)
        fill(temporary)
        _force(temporary)
        put(folder, temporary, name)


@contextmanager
def _named(path: Path, *temporaries: Path | None) -> Iterator[None]:
    """Have errors over the temporary files be over the file at `path`, and leave none of them."""
    try:
        yield
    except SpinError as e:
        _remove(temporaries)
        if e.where is not None and str(e.where) != str(temporaries[0]):
            raise  # over its sources
        raise type(e)(e.found, where=path, do=e.do) from e
    except OSError as e:
        _remove(temporaries)
        raise _unwritten(path, e) from e


def _remove(temporaries: Iterable[Path | None]) -> None:
    for temporary in temporaries:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _create(path: Path, data: bytes, *, forced: bool) -> None:
    """Write the data to the file at `path`, and make its folder if missing."""
    try:
        write_whole(path, data, forced=forced)
    except FileNotFoundError:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, data, forced=forced)


def _linked(path: Path, second: Path) -> bool:
    """Give the file at `path` a second one, and return whether the file system does that."""
    try:
        os.link(path, second)
    except OSError:
        return False
    return True


def force_folder(folder: Path) -> None:
    """Force all files below the folder to disk, before it gets the name by which it is known. Raises OSError."""
    for parent, _, names in os.walk(folder):
        for name in names:
            _force(Path(parent, name))


def link_atomically(folder: Folder, name: str, source: FileIn, *, work: Path, copy: bool = False) -> None:
    """Make the file `name` of the folder another name of the `source`, or a copy if requested, or if the file system
    has no links (or no more for that file). Replacing either later does not change the other. Raises OutputError,
    leaving nothing, and InputError if the source is not a file."""
    temporary = _temporary(work, name)
    try:
        work.mkdir(parents=True, exist_ok=True)
        if copy or not link(source, temporary):
            with source.open() as original, temporary.open("xb") as made:
                shutil.copyfileobj(original, made)
            _force(temporary)
        put(folder, temporary, name)
    except OSError as e:
        raise _unwritten(folder.root / name, e) from e
    finally:
        temporary.unlink(missing_ok=True)  # to rename a file to another name of itself does nothing, by POSIX


def write_json(folder: Folder, name: str, value: Mapping[str, Any], *, work: Path) -> str:
    """Write `value` as JSON into the file `name` of the folder, atomically, and return its sha256."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    return write_text(folder, name, text, work=work)


def write_text(folder: Folder, name: str, text: str, *, work: Path) -> str:
    """Write `text` as UTF-8 into the file `name` of the folder, atomically, and return its sha256."""
    return write_atomically(folder, name, text.encode, work=work)


def _temporary(work: Path, name: str) -> Path:
    return work / f"{PROCESS}-{next(NUMBERS)}{PurePosixPath(name).suffix}"


def _force(path: Path) -> None:
    """Force the file to disk."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


def _unwritten(path: Path, e: OSError) -> OutputError:
    do = "free some space or choose another folder"
    return OutputError(f"cannot be written ({e.strerror or e})", where=path, do=do)
