"""Arrays that a child gives its parent in memory that both have open: a file without a name, which ends with both."""

import mmap
import os
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.processes.held_folder import nameless_file

ALIGNED = 64  # bytes
FIRST = 1 << 20
Entry = list[Any]
"""An array's kind, its type as numpy describes it, its shape, and its offset."""


def new_memory() -> int:
    """Return the file descriptor of new memory for arrays, to pass to a child."""
    memory = nameless_file()
    os.ftruncate(memory, FIRST)
    return memory


class SharedArrays:
    """The arrays of one answer at a time, in the memory behind a file descriptor."""

    def __init__(self, memory: int) -> None:
        self._memory = memory
        self._map = mmap.mmap(memory, os.fstat(memory).st_size)

    def put(self, arrays: Mapping[str, NDArray[Any]]) -> list[Entry]:
        """Replace the arrays by these; return the entries by which `taken` finds them."""
        entries, end = [], 0
        for kind, array in arrays.items():
            entries.append([kind, numpy_type(array.dtype), list(array.shape), end])
            end += -(-array.nbytes // ALIGNED) * ALIGNED
        if end > len(self._map):
            os.ftruncate(self._memory, max(end, 2 * len(self._map)))
            self._open()
        for (_, _, _, start), array in zip(entries, arrays.values(), strict=True):
            self._map[start : start + array.nbytes] = memoryview(array).cast("B") if array.nbytes else b""
        return entries

    def taken(self, entries: list[Entry]) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield by kind copies of the arrays that were put."""
        if entries and os.fstat(self._memory).st_size != len(self._map):
            self._open()
        for kind, described, shape, start in entries:
            dtype = np.dtype(described if isinstance(described, str) else [tuple(each) for each in described])
            size = int(np.prod(shape)) * dtype.itemsize
            yield kind, np.frombuffer(self._map[start : start + size], dtype).reshape(shape).copy()

    def close(self) -> None:
        """Give the memory back."""
        self._map.close()
        os.close(self._memory)

    def _open(self) -> None:
        self._map.close()
        self._map = mmap.mmap(self._memory, os.fstat(self._memory).st_size)


def numpy_type(dtype: np.dtype[Any]) -> Any:
    """Return the type as numpy describes it: text, or for a table a list of columns."""
    return dtype.str if dtype.names is None else dtype.descr
