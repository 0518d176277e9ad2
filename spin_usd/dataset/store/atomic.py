"""Files that are there whole or not at all: written in a run's work folder, forced to disk, then put into place.

Every `work` is a folder of the run's own, on the file system of the files that are written by way of it.
"""

import json
import os
import secrets
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from spin_usd.errors import OutputError, SpinError
from spin_usd.sha256 import sha256_of


def write_atomically(
    path: Path, write: Callable[[Path], None], *, work: Path, place: Callable[[str], Path] | None = None
) -> str:
    """Let `write` fill a file in `work`, force it to disk, make it `path`, and return its sha256 (hex).

    It becomes `path`, or what `place` says of its sha256. There is never half a file. Raises OutputError, or the
    SpinError that `write` raises, leaving nothing.
    """
    temporary = _temporary(work, path)
    try:
        work.mkdir(parents=True, exist_ok=True)
        write(temporary)
        digest = _synced(temporary)
        _put(temporary, place(digest) if place else path)
    except SpinError as e:
        temporary.unlink(missing_ok=True)
        raise type(e)(e.found, where=path, do=e.do) from e
    except OSError as e:
        temporary.unlink(missing_ok=True)
        raise _unwritten(path, e) from e
    return digest


def link_atomically(path: Path, source: Path, *, work: Path, copy: bool = False) -> None:
    """Make `path` another name of the file `source`, or a copy of it where that is asked for, or the file system has no
    links (or no more of that file). To replace either later leaves the other as it is. Raises OutputError, leaving
    nothing."""
    temporary = _temporary(work, path)
    try:
        work.mkdir(parents=True, exist_ok=True)
        if copy or not _linked(temporary, source):
            shutil.copyfile(source, temporary)
            _synced(temporary)
        _put(temporary, path)
    except OSError as e:
        raise _unwritten(path, e) from e
    finally:
        temporary.unlink(missing_ok=True)  # to rename a file to another name of itself does nothing, by POSIX


def write_json(path: Path, value: Mapping[str, Any], *, work: Path) -> str:
    """Write `value` as JSON at `path`, atomically, and return its sha256."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    return write_text(path, text, work=work)


def write_text(path: Path, text: str, *, work: Path) -> str:
    """Write `text` as UTF-8 at `path`, atomically, and return its sha256."""
    return write_atomically(path, lambda temporary: _write_text(temporary, text), work=work)


def _temporary(work: Path, path: Path) -> Path:
    return work / f"{secrets.token_hex(8)}{path.suffix}"


def _linked(path: Path, source: Path) -> bool:
    """Make `path` a hard link of `source`, and return whether that could be done."""
    try:
        path.hardlink_to(source)
    except OSError:
        return False
    return True


def _put(temporary: Path, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary.replace(path)


def _synced(path: Path) -> str:
    """Force the file to disk; returns its sha256."""
    with path.open("rb") as file:
        os.fsync(file.fileno())
    return sha256_of(path)


def _unwritten(path: Path, e: OSError) -> OutputError:
    do = "free some space or choose another folder"
    return OutputError(f"cannot be written ({e.strerror or e})", where=path, do=do)


def _write_text(path: Path, text: str) -> None:
    with path.open("w", encoding="utf-8") as file:
        file.write(text)
