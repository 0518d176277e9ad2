"""The events of one variant as those who train with them read them: slices of time, and arrays made of them."""

import os
from collections.abc import Iterator
from math import ceil, isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn
from spin_usd.formats.event_file import EventFile
from spin_usd.geometry.rotation import turn_between
from spin_usd.scene.event import Events

SECOND = 1e6  # microseconds
PACKET = 2**20  # events


class EventStream:
    """The events of one variant, in order of time.

    Times are seconds on the stage's clock, as Picture.time_s. Slices contain events from their start to before their
    end, and read only these. The file is opened on first access in each process, so a stream is quick to pickle and
    works in PyTorch's DataLoader.
    """

    def __init__(self, source: FileIn) -> None:
        self._source = source
        self._opened: tuple[int, EventFile] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_opened": None}

    def __len__(self) -> int:
        return len(self._file)

    def __repr__(self) -> str:
        return f"EventStream({str(self._source.path)!r})"

    @property
    def start_us(self) -> int:
        """When the stream begins, whole microseconds on the stage's clock."""
        return self._file.start_us

    @property
    def start(self) -> float:
        """When the stream begins, seconds."""
        return self.start_us / SECOND

    @property
    def duration(self) -> float:
        """How long it is, seconds."""
        return self._file.duration_us / SECOND

    @property
    def width(self) -> int:
        """Pixels of a row."""
        return self._file.width

    @property
    def height(self) -> int:
        """Rows of pixels."""
        return self._file.height

    @property
    def variant(self) -> str:
        """The variant that it is of."""
        return self._file.variant

    @property
    def targets(self) -> tuple[str, ...]:
        """The targets that `pose` knows."""
        return self._file.names

    def between(self, start: float, end: float) -> Events:
        """Return the events (N,): t int64, microseconds on the stage's clock; x and y uint16, column and row; p bool,
        whether it is brighter; and, where the dataset has labels of events, target and part uint16."""
        return self._file.between(_microseconds(start), _microseconds(end))

    def packets(self, count: int = PACKET) -> Iterator[Events]:
        """Yield all events, as `between` has them, `count` at a time."""
        return (self._file.piece(first, first + count) for first in range(0, len(self), count))

    def windows(self, seconds: float, step: float | None = None) -> Iterator[tuple[float, float]]:
        """Yield start and end of all windows of that length that lie in the stream, one each `step` seconds; side by
        side if that is not given. Raises InputError for lengths that are not above 0."""
        step = seconds if step is None else step
        if not (seconds > 0 and step > 0):
            raise InputError(f"there are no windows of {seconds} s each {step} s", do="give numbers above 0")
        count = int((self.duration - seconds) / step + 1e-9) + 1 if seconds <= self.duration + 1e-9 else 0
        return ((self.start + k * step, self.start + k * step + seconds) for k in range(count))

    def frame(self, start: float, end: float) -> NDArray[np.int32]:
        """Return (2, H, W): how many events each pixel has, brighter ones in channel 0, darker ones in channel 1."""
        events = self.between(start, end)
        shape = (2, self.height, self.width)
        counts = np.bincount(self._pixels(events), minlength=2 * self.height * self.width)
        return counts.astype(np.int32).reshape(shape)

    def voxel_grid(self, start: float, end: float, bins: int) -> NDArray[np.float32]:
        """Return (bins, H, W): the sum of +1 for each brighter and -1 for each darker event, shared by the two bins
        that are nearest in time, as in Zhu and others (2019). The first bin's middle is the start and the last one's is
        the end, whenever the first and the last event are. Raises InputError without bins, or without time."""
        if bins < 1 or not end > start:
            found = f"there is no grid of {bins} bins from {start:g} to {end:g} s"
            raise InputError(found, do="give 1 bin or more, and an end after the start")
        events = self.between(start, end)
        at = (bins - 1) * (events["t"] / SECOND - start) / (end - start)
        lower = np.clip(np.floor(at), 0, max(bins - 2, 0)).astype(np.int64)
        upper = np.clip(at - lower, 0, 1)
        sign = np.where(events["p"], 1.0, -1.0)
        pixel = events["y"].astype(np.int64) * self.width + events["x"]
        size = self.height * self.width
        grid = np.bincount(lower * size + pixel, sign * (1 - upper), minlength=bins * size)
        if bins > 1:
            grid += np.bincount((lower + 1) * size + pixel, sign * upper, minlength=bins * size)
        return grid.astype(np.float32).reshape(bins, self.height, self.width)

    def time_surface(self, start: float, end: float, decay: float) -> NDArray[np.float32]:
        """Return (2, H, W): exp(-(end - t) / decay) of the last event at t of each pixel, 0 without events; channels as
        in `frame`. decay: seconds. Raises InputError unless it is above 0."""
        if not decay > 0:
            raise InputError(f"events cannot decay in {decay} s", do="give a number above 0")
        events = self.between(start, end)
        surface = np.zeros((2, self.height, self.width), np.float32)
        # In order of time: of several events of a pixel numpy keeps the last.
        surface.reshape(-1)[self._pixels(events)] = np.exp((events["t"] / SECOND - end) / decay)
        return surface

    def pose(self, time: float, target: str | None = None) -> Float:
        """Return T_cam_body (4, 4) at that time, of the target of that name, or of the first: between two stored poses
        it turns the shorter way at a constant rate, and moves on a straight line. Raises InputError if there is no such
        target, or no pose at that time."""
        file = self._file
        if target is not None and target not in file.names:
            do = f"choose among {', '.join(file.names)}"
            raise InputError(f"has no target {target!r}", where=self._source.path, do=do)
        body = 0 if target is None else file.names.index(target)
        times, at = file.pose_times, time * SECOND
        if not (len(times) and times[0] - 0.5 <= at <= times[-1] + 0.5):
            known = f", but from {times[0] / SECOND} to {times[-1] / SECOND} s" if len(times) else ""
            raise InputError(f"has no pose at {time} s{known}", where=self._source.path, do="choose another time")
        before = min(max(int(np.searchsorted(times, at, "right")) - 1, 0), max(len(times) - 2, 0))
        first, *others = np.asarray(file.poses[before : before + 2, body])
        last = others[0] if others else first
        share = min(max((at - times[before]) / (times[before + 1] - times[before]), 0), 1) if others else 0.0
        found = np.eye(4)
        found[:3, :3] = turn_between(first[:3, :3], last[:3, :3], share)
        found[:3, 3] = (1 - share) * first[:3, 3] + share * last[:3, 3]
        return found

    def _pixels(self, events: Events) -> NDArray[np.int64]:
        """Return the place of each event's pixel (N,) in an array (2, H, W)."""
        row = np.where(events["p"], 0, self.height) + events["y"].astype(np.int64)
        return np.asarray(row * self.width + events["x"])

    @property
    def _file(self) -> EventFile:
        """The file as this process has opened it: a forked one would share its place in the file with its parent."""
        if self._opened is None or self._opened[0] != os.getpid():
            self._opened = (os.getpid(), EventFile(self._source))
        return self._opened[1]


def _microseconds(time: float) -> int:
    """Return the first whole microsecond not before that time, which is rounded to nanoseconds first. Raises InputError
    for a value that is not a time."""
    if not isfinite(time):
        raise InputError(f"{time} is not a time", do="give seconds on the stage's clock")
    return ceil(round(time * SECOND, 3))
