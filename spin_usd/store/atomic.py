"""Files that are there whole or not at all: written in a run's work folder, forced to disk, then put into place.

Every `work` is a folder of the run's own, on the file system of the files that are written by way of it.
"""

import json
import os
import secrets
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

from spin_usd.errors import OutputError, SpinError
from spin_usd.files.changes import link, put
from spin_usd.files.folder import FileIn, Folder
from spin_usd.files.new_file import write_whole
from spin_usd.sha256 import sha256_of


def write_atomically(
    folder: Folder, name: str, write: Callable[[Path], None], *, work: Path, place: Callable[[str], str] | None = None
) -> str:
    """Let `write` fill a file in `work`, force it to disk, put it into the folder, and return its sha256 (hex).

    It becomes the file `name` there, or the one that `place` says of its sha256. There is never half a file. Raises
    OutputError, or the SpinError that `write` raises, leaving nothing.
    """
    temporary, path = _temporary(work, name), folder.root / name
    try:
        work.mkdir(parents=True, exist_ok=True)
        write(temporary)
        digest = _synced(temporary)
        put(folder, temporary, place(digest) if place else name)
    except SpinError as e:
        temporary.unlink(missing_ok=True)
        if e.where is not None and str(e.where) != str(temporary):
            raise  # over what it was made of
        raise type(e)(e.found, where=path, do=e.do) from e
    except OSError as e:
        temporary.unlink(missing_ok=True)
        raise _unwritten(path, e) from e
    return digest


def link_atomically(folder: Folder, name: str, source: FileIn, *, work: Path, copy: bool = False) -> None:
    """Make the file `name` of the folder another name of the `source`, or a copy of it where that is asked for, or the
    file system has no links (or no more of that file). To replace either later leaves the other as it is. Raises
    OutputError, leaving nothing, and InputError where the source is no file."""
    temporary = _temporary(work, name)
    try:
        work.mkdir(parents=True, exist_ok=True)
        if copy or not link(source, temporary):
            with source.open() as original, temporary.open("xb") as made:
                shutil.copyfileobj(original, made)
            _synced(temporary)
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
    return write_atomically(folder, name, partial(write_whole, data=text.encode()), work=work)


def _temporary(work: Path, name: str) -> Path:
    return work / f"{secrets.token_hex(8)}{PurePosixPath(name).suffix}"


def _synced(path: Path) -> str:
    """Force the file to disk; returns its sha256."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
    return sha256_of(path)


def _unwritten(path: Path, e: OSError) -> OutputError:
    do = "free some space or choose another folder"
    return OutputError(f"cannot be written ({e.strerror or e})", where=path, do=do)
