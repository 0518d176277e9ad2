"""A body's motion between its samples, if the stage has its rates: SpinMotionAPI."""

from typing import Self

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError
from spin_usd.geometry.motion import Motion, between, log
from spin_usd.geometry.transform import Transform
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read_samples, refuse_unapplied

ATTRIBUTES = (schema.MOTION_VELOCITY, schema.MOTION_ANGULAR_VELOCITY)
SHORT_S = 1e-3  # seconds, over which a difference is a rate
OPERATIONS = ["xformOp:translate", "xformOp:orient"]


class KnownMotion:
    """Motion of a prim in its parent's axes.

    USD interpolates in straight lines and by slerp; its values between samples are corrected.
    """

    def __init__(self, prim: Usd.Prim, clock: Clock, samples: dict[float, tuple[Float, Float]]) -> None:
        self._xform, self._clock, self._samples = UsdGeom.Xformable(prim), clock, samples
        self._codes = np.array(list(samples))

    @classmethod
    def of(cls, prim: Usd.Prim, clock: Clock) -> Self | None:
        """Read the prim's motion; None if the stage has no rates, or no times. Raises StageError for rates that are not
        at the samples of a plain pose."""
        if not prim.HasAPI(schema.MOTION_API):
            refuse_unapplied(prim, "spin:motion:", schema.MOTION_API)
            return None
        velocities, rates = (
            dict(read_samples(prim.GetAttribute(name), Sdf.ValueTypeNames.Double3)) for name in ATTRIBUTES
        )
        if not (velocities and clock.timed):
            return None
        ops = UsdGeom.Xformable(prim).GetOrderedXformOps()
        moving = {float(time) for op in ops for time in op.GetTimeSamples()}
        if [op.GetOpName() for op in ops] != OPERATIONS or not velocities.keys() == rates.keys() == moving:
            found = "are not at the samples of its pose, or that has other operations than translate and orient"
            raise StageError(
                f"has rates that {found}", where=prim.GetPath(), do="give the rates anew, or remove SpinMotionAPI"
            )
        numbers = {code: (np.array(each), np.radians(np.array(rates[code]))) for code, each in velocities.items()}
        if bad := next((code for code, each in numbers.items() if not np.isfinite(each).all()), None):
            raise StageError(f"has rates at time code {bad:g} that are not finite", where=prim.GetPath())
        return cls(prim, clock, numbers)

    def at(self, time_code: float) -> Motion:
        """Return the motion: at a sample the stage's values, at other times the cubics'."""
        if time_code in self._samples:
            rotation, place = self._local(time_code)
            velocity, rate = self._samples[time_code]
            return Motion(rotation=rotation, place=place, velocity=velocity, rate=rate)
        steps = [self._clock.time_code(self._clock.seconds(time_code) + each) for each in (-SHORT_S, SHORT_S)]
        (first, start), (last, end) = (self._moved(code) for code in steps)
        rotation, place = self._moved(time_code)
        rate = log(last @ first.T) / (2 * SHORT_S)
        return Motion(rotation=rotation, place=place, velocity=(end - start) / (2 * SHORT_S), rate=rate)

    def correction(self, time_code: float, size: float) -> Transform | None:
        """Return T_a_b from the prim's true axes `b` to USD's axes `a` at that time, in units of the parent times
        `size`; None at samples, where both are the same."""
        if time_code in self._samples:
            return None
        rotation, place = self._moved(time_code)
        of_usd, usd_place = self._local(time_code)
        return Transform.unchecked(
            to="body", of="body", rotation=of_usd.T @ rotation, translation=of_usd.T @ (place - usd_place) * size
        )

    def _moved(self, time_code: float) -> tuple[Float, Float]:
        seconds, after = self._clock.seconds, int(np.searchsorted(self._codes, time_code))
        first = float(self._codes[max(after - 1, 0)])
        motion = self.at(first)
        if after in (0, len(self._codes)):
            return motion.after(seconds(time_code) - seconds(first))
        last = float(self._codes[after])
        return between(motion, self.at(last), seconds(last) - seconds(first), seconds(time_code) - seconds(first))

    def _local(self, time_code: float) -> tuple[Float, Float]:
        matrix = np.array(self._xform.GetLocalTransformation(Usd.TimeCode(time_code)))
        return matrix[:3, :3].T, matrix[3, :3]
