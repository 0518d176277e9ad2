"""How far predicted poses are from the true ones, and the scores that SPEED and SPEED+ make of it.

Sources: Kisantal et al. 2020, "Satellite Pose Estimation Challenge", for the score; Park et al. 2022, "SPEED+", for the
thresholds, which are what its calibration is good to; the notes of tpark94/speedplusbaseline on their change.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

POSITION_THRESHOLD = 2.173e-3  # of the distance
ATTITUDE_THRESHOLD = np.deg2rad(0.169)


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseErrors:
    """How far N predicted poses are off."""

    position: Float
    """(N,): metres between true and predicted origins."""
    attitude: Float
    """(N,): the angle of the rotation between the two, radians, 0 to pi."""
    range: Float
    """(N,): true distances, metres."""

    @classmethod
    def of(cls, *, q: Float, t: Float, true_q: Float, true_t: Float) -> Self:
        """Compare unit quaternions (N, 4), scalar first, and positions (N, 3), metres, with the true ones."""
        return cls(
            position=np.linalg.norm(t - true_t, axis=1),
            attitude=angles_between(q, true_q),
            range=np.linalg.norm(true_t, axis=1),
        )

    def __getitem__(self, chosen: NDArray[np.bool_]) -> "PoseErrors":
        """Return the errors of these pictures alone."""
        return PoseErrors(position=self.position[chosen], attitude=self.attitude[chosen], range=self.range[chosen])

    @property
    def relative_position(self) -> Float:
        """(N,) the position's error over the distance."""
        return np.asarray(self.position / self.range)


def angles_between(one: Float, other: Float) -> Float:
    """Return the angle (N,) of the rotation from one to the other of unit quaternions (N, 4), radians: as exact near 0,
    where an arc cosine loses half of its digits, as elsewhere."""
    other = other * np.where((one * other).sum(1) < 0, -1.0, 1.0)[:, None]  # q and -q are one rotation
    found: Float = 4 * np.arctan2(np.linalg.norm(one - other, axis=1), np.linalg.norm(one + other, axis=1))
    return found


def _no_threshold(position: Float, attitude: Float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    none = np.zeros(position.shape, bool)
    return none, none


def _each(position: Float, attitude: Float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    return position < POSITION_THRESHOLD, attitude < ATTITUDE_THRESHOLD


def _both(position: Float, attitude: Float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    both = np.logical_and(*_each(position, attitude))
    return both, both


SCORES: Mapping[str, Callable[[Float, Float], tuple[NDArray[np.bool_], NDArray[np.bool_]]]] = {
    "speed": _no_threshold,
    "speedplus": _each,
    "speedplus_2021": _both,
}
"""By the name of a score, which errors of position and of attitude count as none: in SPEED, of 2019, none do; in SPEED+
those below a threshold, each on its own; before 12 January 2023 only where both were below theirs."""


def scores(errors: PoseErrors, name: str) -> Float:
    """Return the score (N,) of each picture: the error of its position over the distance, and that of its attitude in
    radians, added. The score of a set is their mean."""
    position, attitude = errors.relative_position, errors.attitude
    no_position, no_attitude = SCORES[name](position, attitude)
    return np.asarray(np.where(no_position, 0.0, position) + np.where(no_attitude, 0.0, attitude))
