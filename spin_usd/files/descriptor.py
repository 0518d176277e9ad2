"""Open files before anything is read of them: regular ones alone, none larger than its kind can be."""

import os
import stat

from spin_usd.errors import InputError

NO_FILES = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}
# Opening a pipe without a writer would block; no child process inherits the file.
FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)

POINTER, MAX_POINTER = b"version https://git-lfs.github.com/spec/", 1024
"""First bytes of the pointer that a repository holds in place of a large file, and its largest size in bytes."""


def checked(descriptor: int, max_bytes: int, where: object) -> int:
    """Return the open `descriptor`, which is closed where it is of no regular file, or of more than `max_bytes`. Raises
    InputError then."""
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            kind = NO_FILES.get(stat.S_IFMT(status.st_mode), "no regular file")
            raise InputError(f"cannot be read: it is {kind}", where=where, do="put a file there")
        if status.st_size > max_bytes:
            raise InputError(f"has more than {max_bytes} bytes", where=where, do="make it smaller")
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def to_read(descriptor: int, max_bytes: int, where: object) -> int:
    """Return the `descriptor` as `checked` does, of a file to be read. Raises InputError for a stand-in of one too."""
    checked(descriptor, max_bytes, where)
    if os.fstat(descriptor).st_size <= MAX_POINTER:
        if os.read(descriptor, len(POINTER)) == POINTER:
            os.close(descriptor)
            found = "is a pointer of Git LFS, not the file itself"
            raise InputError(found, where=where, do="run git lfs pull")
        os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor


def read_all(descriptor: int, where: object) -> bytes:
    """Read all of a file that does not grow meanwhile. Raises InputError."""
    size = os.fstat(descriptor).st_size
    try:
        data = os.read(descriptor, size + 1)
        while 0 < len(data) < size and (more := os.read(descriptor, size + 1 - len(data))):  # one call may read less
            data += more
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=where, do="check the disk") from None
    if len(data) > size:
        raise InputError("grows while it is read", where=where, do="wait until it is whole")
    return data
