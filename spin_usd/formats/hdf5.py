"""HDF5 files: columns that are written in pieces, and data that is read from no other file than the one that was given.

Equal columns are equal bytes, however they were cut into pieces: the file has no times, and gets its chunks whole and
in order. Compression is HDF5's own gzip, so that no plugin is needed.
"""

from collections.abc import Mapping
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.faults import reading

if TYPE_CHECKING:
    import h5py

CHUNK = 2**16  # rows


class _Bytes(FileIO):
    """A file that HDF5 writes its bytes to. It keeps the first `fault` and reports later writes as done: an HDF5 that
    learns of a full disk cannot close its file, and ends the process at exit."""

    fault: OSError | None = None

    def write(self, data: Any, /) -> int:
        left = memoryview(data).cast("B")
        try:
            while left and not self.fault:
                left = left[super().write(left) :]
        except OSError as fault:
            self.fault = fault
        return memoryview(data).nbytes

    def truncate(self, size: int | None = None, /) -> int:
        try:
            return super().truncate(size) if not self.fault else 0
        except OSError as fault:
            self.fault = fault
            return 0


class ColumnFile:
    """Writes an HDF5 file at `path`, which is new, with columns of the types in `columns`, by their paths in it; memory
    does not grow with their length. It is complete after `finish`, at the block's end; `file` takes further contents.

    Raises MissingPackageError without h5py, and OSError if the system does not accept all bytes.
    """

    def __init__(self, path: Path, columns: Mapping[str, str]) -> None:
        with reading():
            import h5py
        self._bytes = _Bytes(path, "w+")
        self.file = h5py.File(self._bytes, "w", libver="earliest")
        self._buffer = {name: np.empty(CHUNK, type) for name, type in columns.items()}
        self._columns = {
            name: self.file.create_dataset(
                name, (0,), column.dtype, maxshape=(None,), chunks=(CHUNK,), compression=1, shuffle=True
            )
            for name, column in self._buffer.items()
        }
        self._written = self._held = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()
        self._bytes.close()
        self._refuse_fault()

    def __len__(self) -> int:
        return self._written + self._held

    def append(self, values: Mapping[str, NDArray[Any]]) -> None:
        """Add rows: the values (N,) of each column."""
        count, done = len(next(iter(values.values()))), 0
        while done < count:
            piece = slice(done, min(done + CHUNK - self._held, count))
            held = slice(self._held, self._held + piece.stop - piece.start)
            for name, column in self._buffer.items():
                column[held] = values[name][piece]
            done, self._held = piece.stop, held.stop
            if self._held == CHUNK:
                self._flush()

    def finish(self) -> None:
        """Write the buffered rows."""
        self._flush()

    def _flush(self) -> None:
        for name, column in self._columns.items():
            column.resize((self._written + self._held,))
            column[self._written :] = self._buffer[name][: self._held]
        self._written, self._held = self._written + self._held, 0
        self._refuse_fault()

    def _refuse_fault(self) -> None:
        if self._bytes.fault:
            raise self._bytes.fault


def open_hdf5(source: BinaryIO) -> "h5py.File":
    """Open the file to read it. Raises OSError for any other file, and MissingPackageError without h5py."""
    with reading():
        import h5py
    return h5py.File(source, "r")


def own_dataset(file: "h5py.File", name: str) -> "h5py.Dataset":
    """Return the dataset of that name, whose numbers lie in the file itself. Raises KeyError and ValueError."""
    import h5py

    group, _, _ = name.rpartition("/")
    links = [file.get(each, getlink=True) for each in (group, name) if each]
    found = file[name] if all(isinstance(link, h5py.HardLink) for link in links) else None
    if not isinstance(found, h5py.Dataset) or found.is_virtual or found.external:
        raise ValueError(f"{name} is not in the file itself")
    return found


def fixed_text(text: Any) -> NDArray[Any]:
    """Return the text, or texts, as HDF5's UTF-8 of one length: over a damaged file with others HDF5 may never end."""
    import h5py

    made = np.char.encode(np.asarray(text, np.str_), "utf-8")
    return made.astype(h5py.string_dtype("utf-8", max(made.dtype.itemsize, 1)))
