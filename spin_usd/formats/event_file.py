"""Event files: the events of one variant as HDF5 in DSEC's layout, written in pieces and read by slices of time.

Source: Gehrig and others, "DSEC: A Stereo Event Camera Dataset for Driving Scenarios" (2021), and its loaders, which
know events/t, x, y and p, ms_to_idx and t_offset. Root attributes, events/target, events/part and the group `poses` are
ours. Equal events are equal bytes, however they were cut into appends.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn
from spin_usd.formats.hdf5 import ColumnFile, fixed_text, open_hdf5, own_dataset
from spin_usd.scene.event import EVENT, Events

LONGEST = 2**32 - 1  # microseconds
MILLISECOND = 1000  # microseconds
SIDE = 2**16  # pixels
GROUP = "events"
COLUMNS = {"t": "<u4", "x": "<u2", "y": "<u2", "p": "|u1"}
"""Types of the columns in the file."""
LABELS = {"target": "<u2", "part": "<u2"}
"""Types of the label columns, if labels were requested: ids as in `instance` and `segmentation`, 0 for none."""


class EventFileWriter:
    """Writes an event file at `path`, which is new; memory does not grow with the number of events.

    width, height: of the sensor, pixels. start_us: of the stream, microseconds on the stage's clock. labelled: whether
    events have target and part. A file is whole after `finish`, at the block's end.
    Raises MissingPackageError without h5py, and OSError where the system does not take all bytes, once it is known.
    """

    def __init__(self, path: Path, *, width: int, height: int, variant: str, start_us: int, labelled: bool) -> None:
        self._path, self._start = path, start_us
        columns = COLUMNS | (LABELS if labelled else {})
        self._columns = ColumnFile(path, {f"{GROUP}/{name}": type for name, type in columns.items()})
        self._names = tuple(columns)
        self._columns.file.attrs.update({"width": width, "height": height, "variant": fixed_text(variant)})
        self._columns.file["t_offset"] = np.int64(start_us)
        self._last = 0
        self._index: list[NDArray[np.uint64]] = []
        self._indexed = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._columns.__exit__(*error)

    def append(self, events: Events) -> None:
        """Add events (N,) with the fields of EVENT, at times from the stream's start on, in order. Raises InputError
        for times out of order, or beyond 32 bits of microseconds."""
        times = events["t"] - self._start
        if not len(times):
            return
        if times[0] < self._last or (np.diff(times) < 0).any():
            raise InputError("events are not in the order of their times", where=self._path, do="sort them by t")
        self._last = int(times[-1])
        self._refuse_long(self._last)
        begun = np.arange(self._indexed, self._last // MILLISECOND + 1) * MILLISECOND
        self._index.append(np.uint64(len(self._columns)) + np.searchsorted(times, begun).astype(np.uint64))
        self._indexed += len(begun)
        self._columns.append({f"{GROUP}/{name}": times if name == "t" else events[name] for name in self._names})

    def finish(self, duration_us: int, pose_times: NDArray[np.int64], poses: Float, names: Sequence[str]) -> None:
        """Write the buffered events, the index and the poses. duration_us: length of the stream, microseconds. poses:
        T_cam_body (M, targets, 4, 4) of the targets of these `names` at the pose_times (M,), microseconds on the
        stage's clock. Raises InputError for a stream that is longer than 32 bits of microseconds."""
        self._refuse_long(duration_us)
        self._columns.finish()
        size = -(-max(duration_us, self._last) // MILLISECOND) + 1
        rest = np.full(max(size - self._indexed, 0), len(self._columns), np.uint64)
        file = self._columns.file
        file["ms_to_idx"] = np.concatenate([*self._index, rest]).astype("<u8")
        file.attrs["duration_us"] = duration_us
        file["poses/t"] = np.asarray(pose_times, "<i8")
        file["poses/T_cam_body"] = np.asarray(poses, "<f8")
        file["poses"].attrs["names"] = fixed_text(names)

    def _refuse_long(self, time_us: int) -> None:
        if time_us > LONGEST:
            found = f"a stream of {time_us / 1e6:.0f} s is longer than the {LONGEST / 1e6:.0f} s that its file holds"
            raise InputError(found, where=self._path, do="render fewer frames at once")


class EventFile:
    """An open event file, read in slices of time; only the index of its milliseconds is in memory. Raises InputError
    for another or a damaged file, and MissingPackageError without h5py."""

    def __init__(self, source: FileIn) -> None:
        self._path = source.path
        with decoding(self._path):
            file = open_hdf5(source.open())
            self.width, self.height = (int(_attribute(file, name, "i")) for name in ("width", "height"))
            """Pixels."""
            if not (0 < self.width <= SIDE and 0 < self.height <= SIDE):
                raise ValueError(f"it is of {self.width} x {self.height} pixels")
            self.variant: str = _attribute(file, "variant", "S").decode()
            self.start_us = int(_own(file, "t_offset", "<i8")[()])
            """Of the stream, on the stage's clock."""
            self.duration_us = int(_attribute(file, "duration_us", "i"))
            labels = LABELS if "target" in file[GROUP] else {}
            self._columns = {name: _own(file, f"{GROUP}/{name}", type) for name, type in (COLUMNS | labels).items()}
            (self._count,) = {len(column) for column in self._columns.values()}
            self._index: NDArray[np.uint64] = _own(file, "ms_to_idx", "<u8")[:]
            if not len(self._index) or self._index[-1] > self._count or (self._index[1:] < self._index[:-1]).any():
                raise ValueError("ms_to_idx is not an index of its events")
            self.pose_times: NDArray[np.int64] = _own(file, "poses/t", "<i8")[:]
            """(M,) microseconds on the stage's clock."""
            self.poses = _own(file, "poses/T_cam_body", "<f8")
            """(M, targets, 4, 4) T_cam_body, read as it is sliced."""
            self.names = tuple(name.decode() for name in _attribute(file["poses"], "names", "S"))
            """Of the targets."""
            if self.poses.shape != (len(self.pose_times), len(self.names), 4, 4):
                raise ValueError("its poses do not match its targets and times")
        self._type = np.dtype([(name, EVENT[name]) for name in self._columns])

    def __len__(self) -> int:
        return self._count

    def between(self, start_us: int, end_us: int) -> Events:
        """Read the events from `start_us` to before `end_us`, microseconds on the stage's clock."""
        return self.piece(self._place(start_us), self._place(end_us))

    def piece(self, first: int, last: int) -> Events:
        """Read the events from place `first` to before `last`."""
        events = np.empty(max(min(last, self._count) - first, 0), self._type)
        with decoding(self._path):
            for name, column in self._columns.items():
                events[name] = column[first : first + len(events)]
            if (events["x"] >= self.width).any() or (events["y"] >= self.height).any():
                raise ValueError("an event is beyond the sensor")
        events["t"] += self.start_us
        return events

    def _place(self, time_us: int) -> int:
        """Return the place of the first event that is not before that time."""
        since = time_us - self.start_us
        if since <= 0:
            return 0
        at = min(since // MILLISECOND, len(self._index) - 1)
        first, *following = self._index[at : at + 2].tolist()
        last = following[0] if following else self._count
        with decoding(self._path):
            return int(first + np.searchsorted(self._columns["t"][first:last], since))


def _attribute(node: Any, name: str, kind: str) -> Any:
    """Return the attribute of that name and kind of numpy's types: "i", or "S" for texts of one length. Raises KeyError
    and ValueError."""
    if (found := node.attrs.get_id(name).dtype).kind != kind:
        raise ValueError(f"{name} is of {found}")
    return node.attrs[name]


def _own(file: Any, name: str, type: str) -> Any:
    """Return the h5py.Dataset of that name and type. Raises KeyError and ValueError."""
    if (found := own_dataset(file, name)).dtype != type:
        raise ValueError(f"{name} holds {found.dtype}")
    return found
