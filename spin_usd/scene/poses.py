"""A list of poses, each with the name of the picture taken from it."""

import re
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Self

import numpy as np

from spin_usd.basics.arrays import Float, finite, frozen
from spin_usd.basics.json_fields import FRAME_PATTERN
from spin_usd.errors import GeometryError
from spin_usd.geometry.rotation import QUATERNION_NORM_TOLERANCE

FRAME_NAME = re.compile(FRAME_PATTERN)
RATES = ("velocities", "angular_velocities")
FRAME_NAME_RULE = "use up to 200 letters, digits, '.', '_' and '-', the first a letter or digit, and not '.tmp-'"


def repeated_name(names: Sequence[str]) -> tuple[int, int] | None:
    """Indices of the first two names that are the same to a file system that ignores capitals; None if all differ."""
    seen: dict[str, int] = {}
    for i, name in enumerate(names):
        first = seen.setdefault(name.lower(), i)
        if first != i:
            return first, i
    return None


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseList:
    """The poses of a body in N pictures.

    Quaternions are normalised; GeometryError when one is off by more than rounding.
    """

    names: tuple[str, ...]
    """(N), unique, also where capitals do not count."""
    q_cam_body: Float
    """(N, 4) unit quaternions, scalar first."""
    t_cam_body: Float
    """(N, 3) metres."""
    files: tuple[str, ...] = ()
    """(N): the names in their source, such as img000001.jpg; empty without a source."""
    times: Float | None = None
    """(N,) seconds since the start, increasing; None if unknown."""
    velocities: Float | None = None
    """(N, 3) of the body's origin, m/s, camera axes; None where they are not known."""
    angular_velocities: Float | None = None
    """(N, 3) radians a second, camera axes, likewise."""
    epoch: str = ""
    """UTC of second 0; "" if unknown."""
    source: str = ""
    """Where they come from."""
    lists: str = ""
    """How many lists a folder had, and their format, in words; "" for a file."""
    notes: tuple[str, ...] = ()
    """Decisions made while reading, for the user."""

    def __post_init__(self) -> None:
        count = len(self.names)
        q = finite(self.q_cam_body, (count, 4), "quaternions")
        norm = np.linalg.norm(q, axis=1)
        off = np.flatnonzero(np.abs(norm - 1) > QUATERNION_NORM_TOLERANCE)
        if len(off):
            i = int(off[0])
            raise GeometryError(f"quaternion has norm {norm[i]:.9g}, expected 1", where=f"pose {i} ({self.names[i]!r})")
        object.__setattr__(self, "q_cam_body", frozen(q / norm[:, None]))
        object.__setattr__(self, "t_cam_body", finite(self.t_cam_body, (count, 3), "positions"))
        if self.times is not None:
            times = finite(self.times, (count,), "times")
            if len(back := np.flatnonzero(np.diff(times) <= 0)):
                i = int(back[0]) + 1
                found = f"its time, {times[i]:g} s, is not after the previous one, {times[i - 1]:g} s"
                raise GeometryError(found, where=f"pose {i} ({self.names[i]!r})", do="put them in their order")
            object.__setattr__(self, "times", times)
        for name in RATES:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, finite(getattr(self, name), (count, 3), name))
        for i, name in enumerate(self.names):
            if not FRAME_NAME.fullmatch(name):
                raise GeometryError(f"{name!r} cannot name a picture", where=f"pose {i}", do=FRAME_NAME_RULE)
        if pair := repeated_name(self.names):
            first, i = pair
            raise GeometryError(f"the name {self.names[i]!r} is that of pose {first} too", where=f"pose {i}")

    def __len__(self) -> int:
        return len(self.names)

    def with_rates(self, velocities: Float | None, angular_velocities: Float | None, note: str) -> Self:
        """Return the same poses with these rates, and one more note; none of their own numbers is rounded anew."""
        other = copy(self)
        for name, rates in zip(RATES, (velocities, angular_velocities), strict=True):
            object.__setattr__(other, name, None if rates is None else finite(rates, (len(self), 3), name))
        object.__setattr__(other, "notes", (*self.notes, note))
        return other

    def __getitem__(self, chosen: slice) -> Self:
        """Return the poses of a Python slice, in its order."""
        timed = self.times is not None and (chosen.step or 1) > 0
        of_times = {name: getattr(self, name) for name in ("times", *RATES)}
        return type(self)(
            names=self.names[chosen],
            q_cam_body=self.q_cam_body[chosen],
            t_cam_body=self.t_cam_body[chosen],
            files=self.files[chosen],
            **{name: each[chosen] if timed and each is not None else None for name, each in of_times.items()},
            epoch=self.epoch,
            source=self.source,
            lists=self.lists,
            notes=self.notes,
        )
