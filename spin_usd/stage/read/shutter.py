"""The times at which the camera's shutter is open.

`shutter:open` and `shutter:close` are time codes relative to the picture's own; equal ones, USD's fallback, are an
instant. Where neither is authored and the pictures have times, the shutter is open for `exposure:time`, around the
picture's own. With a rolling shutter they are the middle row's: the rows above open earlier and those below later. The
labels of a picture describe the middle of that time, so a rolling shutter changes no label.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.geometry.blur import rotation_angle
from spin_usd.geometry.transform import Transform
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import Range, refuse_unapplied, value_in

OPENS, CLOSES = UsdGeom.Tokens.shutterOpen, UsdGeom.Tokens.shutterClose
MIN_POSES, MAX_POSES = 9, 129
STEP_RAD = np.radians(5.0)  # a chord of this angle is off its arc by a thousandth of the radius
TIMES = Range(-1e9, 1e9)  # time codes; a day has two million at 24 a second
READOUTS = EXPOSURE_TIMES = Range(0, 1e6)  # seconds
EXPOSURE_TIME = "exposure:time"
EXACT = 1e-9  # of a time code: tolerance for rounding


@dataclass(frozen=True, kw_only=True)
class Opening:
    """An exposure."""

    middle: float
    """Time code."""
    duration: float = 0.0
    """From the first row's opening to the last row's closing: seconds of the `clock`, time codes without one."""
    readout: float = 0.0
    """The share of that between the first row's opening and the last row's."""
    clock: Clock | None = None
    of_exposure: bool = False
    """True if the opening follows exposure:time, because no shutter is authored."""

    def time_codes(self, count: int) -> list[float]:
        """Return `count` time codes, an odd number, equally far apart in time from its start to its end."""
        steps = ((np.arange(count) / (count - 1) - 0.5) * self.duration).tolist()
        if self.clock is None:
            return [self.middle + step for step in steps]
        middle, half = self.clock.seconds(self.middle), count // 2
        codes = [self.clock.time_code(middle + step) for step in steps]
        return [*codes[:half], self.middle, *codes[half + 1 :]]


def read_opening(prim: Usd.Prim, time_code: float, clock: Clock, *, rows: int) -> Opening:
    """Read the exposure of a frame of `rows` rows at `time_code`. Raises StageError for times that are not valid."""
    time = Usd.TimeCode(time_code)
    start, end = (value_in(prim, name, TIMES, time) for name in (OPENS, CLOSES))
    if start > end:
        found = f"its shutter opens at {start:g} and closes at {end:g}"
        raise StageError(found, where=prim.GetPath(), do="let shutter:close be no less than shutter:open")
    readout = _readout(prim, time) if rows > 1 else 0.0
    middle, of_exposure = time_code + (start + end) / 2, False
    if clock.timed:
        opens, closes = (clock.seconds(time_code + each) for each in (start, end))
        open_for = closes - opens
        if open_for and abs(shift := clock.time_code((opens + closes) / 2) - time_code) > EXACT:
            middle = time_code + shift
        of_exposure = not any(prim.GetAttribute(name).HasAuthoredValue() for name in (OPENS, CLOSES))
        if of_exposure and prim.GetAttribute(EXPOSURE_TIME).HasAuthoredValue():
            open_for = float(value_in(prim, EXPOSURE_TIME, EXPOSURE_TIMES, time))
    else:
        open_for, readout = end - start, readout * prim.GetStage().GetTimeCodesPerSecond()
    duration = open_for + readout
    return Opening(
        middle=middle,
        duration=duration,
        readout=readout / duration if duration else 0.0,
        clock=clock if clock.timed else None,
        of_exposure=of_exposure and not readout,
    )


PoseAt = Callable[[float], Transform]
"""Gives a body's T_cam_body at a time code."""
Poses = tuple[Transform, ...]


def read_poses(opening: Opening, bodies: Sequence[PoseAt], where: object) -> tuple[Poses, ...]:
    """Sample the poses of each of the `bodies` while the shutter is open, all at the times of Shutter.poses; none of
    them for an instant.

    Where rates are not known USD interpolates: translations linearly, orientations by slerp; before the first and after
    the last it holds the value. Raises StageError where a body rotates too fast for MAX_POSES.
    """
    if not opening.duration:
        return tuple(() for _ in bodies)
    count = MIN_POSES
    while count <= MAX_POSES:
        times = opening.time_codes(count)
        poses = tuple(tuple(pose_at(time) for time in times) for pose_at in bodies)
        if max(rotation_angle(a, b) for of_body in poses for a, b in pairwise(of_body)) <= STEP_RAD:
            return poses
        count = 2 * count - 1
    found = f"turns by more than {np.degrees(STEP_RAD):g} degrees in 1/{MAX_POSES - 1} of the exposure"
    raise StageError(
        f"a target or an occluder {found}", where=where, do="bring shutter:open and shutter:close nearer to each other"
    )


def _readout(prim: Usd.Prim, time: Usd.TimeCode) -> float:
    """Read the rolling shutter's readout time, in seconds."""
    if not prim.HasAPI(schema.SHUTTER_API):
        refuse_unapplied(prim, "spin:shutter:", schema.SHUTTER_API)
        return 0.0
    return float(value_in(prim, schema.SHUTTER_READOUT_TIME, READOUTS, time))
