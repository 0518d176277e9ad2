"""Files written whole: the system says of every byte whether it has taken it.

Libraries that write files by themselves lose that word: theirs is success on a full disk. So they encode into memory,
and what they made is written here.
"""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spin_usd.files.descriptor import read_all


def write_whole(path: Path, data: bytes) -> None:
    """Write the file `path` anew, until the system has taken all of the `data`. Raises OSError, such as of a full disk,
    a quota, or the limit of a file's size; a network's file system may say so only when it is closed, or by `fsync`."""
    left = memoryview(data)
    with path.open("wb", buffering=0) as file:
        while left:
            left = left[file.write(left) :]


class MemoryFile:
    """A file that lies in memory where the system has such, and has no name: libraries write to its `path`."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self.path = f"/dev/fd/{descriptor}"

    def data(self) -> bytes:
        """Return all that it holds; less than was written where memory, or the limit of a file's size, ran out."""
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        return read_all(self._descriptor, self.path)


@contextmanager
def memory_file() -> Iterator[MemoryFile]:
    """Open an empty one; it is gone with the block."""
    if not hasattr(os, "memfd_create"):
        with tempfile.TemporaryFile() as file:
            yield MemoryFile(file.fileno())
        return
    descriptor = os.memfd_create("spin_usd")
    try:
        yield MemoryFile(descriptor)
    finally:
        os.close(descriptor)
