"""Files that a user names: regular files alone, opened without waiting, none larger than its kind can be.

A user's own path may be a link, and is followed. What data names below a folder is opened otherwise.
"""

import os
import stat
from pathlib import Path
from typing import BinaryIO

from spin_usd.errors import InputError

KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFLNK: "a link",
}
# A pipe that nobody writes to would be waited for at opening; no child process inherits the file.
FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


def open_file(path: str | Path, max_bytes: int) -> BinaryIO:
    """Open the regular file at `path`, which has at most `max_bytes`, to read it. Raises InputError."""
    try:
        descriptor = os.open(path, FLAGS)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=path, do="check the path") from None
    except ValueError:  # NUL, or what no file system's encoding has
        raise InputError("cannot be the path of a file", where=path, do="check the path") from None
    try:
        check_status(os.fstat(descriptor), max_bytes, path)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def check_status(status: os.stat_result, max_bytes: int, where: object) -> None:
    """Raise InputError unless the file of this `status` is a regular one of at most `max_bytes`."""
    if not stat.S_ISREG(status.st_mode):
        kind = KINDS.get(stat.S_IFMT(status.st_mode), "no regular file")
        raise InputError(f"cannot be read: it is {kind}", where=where, do="give a file")
    if status.st_size > max_bytes:
        raise InputError(f"has more than {max_bytes} bytes", where=where, do="make it smaller")


def read_bytes(path: str | Path, max_bytes: int) -> bytes:
    """Read all of the regular file at `path`, which has at most `max_bytes`. Raises InputError."""
    with open_file(path, max_bytes) as file:
        return read_all(file, path)


def read_text(path: str | Path, max_bytes: int) -> str:
    """Read the text of the regular file at `path`, which has at most `max_bytes`. Raises InputError."""
    return decoded(read_bytes(path, max_bytes), path)


def decoded(data: bytes, where: object) -> str:
    """Return the text in `data`, UTF-8 with or without its mark. Raises InputError."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not a text file", where=where, do="write it as UTF-8") from None


def read_all(file: BinaryIO, where: object) -> bytes:
    """Read all of an open `file` that does not grow meanwhile. Raises InputError."""
    size = os.fstat(file.fileno()).st_size
    try:
        data = file.read(size + 1)
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=where, do="check the disk") from None
    if len(data) > size:
        raise InputError("grows while it is read", where=where, do="wait until it is whole")
    return data


def path_of(file: BinaryIO) -> str:
    """Return a path of an open `file`, for libraries that read from paths alone: it leads to no other file."""
    return f"/dev/fd/{file.fileno()}"
