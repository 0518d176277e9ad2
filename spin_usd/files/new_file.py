"""New files, written so that a full disk is noticed.

Libraries that write files by themselves report success on a full disk. So they encode into memory, and the bytes are
written here, where each system call reports how many it has taken.
"""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from spin_usd.files.descriptor import read_all


def write_whole(path: Path, data: bytes, *, forced: bool = False) -> None:
    """Write the `data` to the file `path`, in place of what it holds; `forced` waits until it is on the disk, otherwise
    writing is only started. Raises OSError if the system does not accept all of it: the disk is full, or a quota or the
    limit of a file's size is reached. A network file system may report this only when the file is closed, or forced to
    disk."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_CLOEXEC", 0), 0o666)
    try:
        left = memoryview(data)
        while left:
            left = left[os.write(descriptor, left) :]
        if forced:
            os.fsync(descriptor)
        elif hasattr(os, "posix_fadvise"):
            with suppress(OSError):  # a hint: Linux starts to write unsaved data
                os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
    finally:
        os.close(descriptor)


class MemoryFile:
    """A file without a name, in memory on systems that have such files. Libraries write to its `path`."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self.path = f"/dev/fd/{descriptor}"

    def data(self) -> bytes:
        """Return all that the file holds: less than was written where memory or the limit of a file's size ran out."""
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        return read_all(self._descriptor, self.path)


@contextmanager
def memory_file() -> Iterator[MemoryFile]:
    """Open an empty MemoryFile, which is gone when the block ends."""
    if not hasattr(os, "memfd_create"):
        with tempfile.TemporaryFile() as file:
            yield MemoryFile(file.fileno())
        return
    descriptor = os.memfd_create("spin_usd")
    try:
        yield MemoryFile(descriptor)
    finally:
        os.close(descriptor)
