"""Files that a user names: only regular files, opened without waiting, none larger than its kind allows.

A user's own path may be a link, and is followed. Names from data, below a folder, are opened differently.
"""

import os
from io import BufferedReader
from pathlib import Path

from spin_usd.errors import InputError
from spin_usd.files.descriptor import FLAGS, read_all, to_read


def open_file(path: str | Path, max_bytes: int) -> BufferedReader:
    """Open the regular file at `path`, which has at most `max_bytes`, to read it. Raises InputError."""
    descriptor = _opened(path, max_bytes)
    return os.fdopen(descriptor, "rb")


def read_bytes(path: str | Path, max_bytes: int) -> bytes:
    """Read all of the regular file at `path`, which has at most `max_bytes`. Raises InputError."""
    descriptor = _opened(path, max_bytes)
    try:
        return read_all(descriptor, path)
    finally:
        os.close(descriptor)


def read_text(path: str | Path, max_bytes: int) -> str:
    """Read the text of the regular file at `path`, which has at most `max_bytes`. Raises InputError."""
    return decoded(read_bytes(path, max_bytes), path)


def names_in(folder: Path) -> list[str]:
    """List the names in a folder, in order; none if there is no such folder, or it cannot be read."""
    try:
        return sorted(os.listdir(folder))
    except OSError:
        return []


def decoded(data: bytes, where: object) -> str:
    """Return the text in `data`, UTF-8 with or without its mark. Raises InputError."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not a text file", where=where, do="write it as UTF-8") from None


def path_of(file: BufferedReader) -> str:
    """Return a path of an open `file`, for libraries that read from paths alone: it leads to no other file."""
    return f"/dev/fd/{file.fileno()}"


def _opened(path: str | Path, max_bytes: int) -> int:
    try:
        descriptor = os.open(path, FLAGS)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=path, do="check the path") from None
    except ValueError:  # NUL, or a character outside the file system's encoding
        raise InputError("cannot be the path of a file", where=path, do="check the path") from None
    return to_read(descriptor, max_bytes, path)
