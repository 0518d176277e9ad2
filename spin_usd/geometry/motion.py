"""Motion between known states: places and attitudes whose rates are continuous.

A place follows the cubic of its two places and velocities (Hermite's). An attitude turns steadily from one to the
other, and is off that turn by a rotation vector: the cubic of what both rates differ by from the steady one.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spin_usd.basics.arrays import Float

SMALL = 1e-4  # radians, below which a power series is exact in double precision
FEWEST = 5  # states, of which every other one can be held against the rest
SMOOTH = 0.3  # of the largest step: half as many samples miss those between by less where a motion is smooth
STILL_M, STILL_RAD = 1e-9, 1e-9  # what rounding leaves of no motion


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Pose and motion of a frame in another one's axes."""

    rotation: Float
    """(3, 3), to the other's axes."""
    place: Float
    """(3,) of its origin."""
    velocity: Float
    """(3,) of its origin, a second."""
    rate: Float
    """(3,) angular velocity, radians a second, in the other's axes."""

    def after(self, seconds: float) -> tuple[Float, Float]:
        """Return rotation and place for constant rates."""
        return exp(self.rate * seconds) @ self.rotation, self.place + self.velocity * seconds


def between(a: Motion, b: Motion, step: float, seconds: float) -> tuple[Float, Float]:
    """Return the rotation and the place `seconds` after `a`, of a motion that is `b` after `step` seconds. Of the turns
    that lead from one attitude to the other it makes the one nearest to the mean of both rates."""
    u = seconds / step
    place = _hermite(u, a.place, b.place, a.velocity * step, b.velocity * step)
    first, last = a.rotation.T @ a.rate * step, b.rotation.T @ b.rate * step
    turn = _nearest_turn(log(a.rotation.T @ b.rotation), (first + last) / 2)
    off = _hermite(u, np.zeros(3), np.zeros(3), first - turn, last - turn)
    return a.rotation @ exp(u * turn) @ exp(off), place


def _hermite(u: float, start: Float, end: Float, first: Float, last: Float) -> Float:
    """Return the cubic from `start` to `end` with these derivatives by `u`, 0 to 1."""
    moved: Float = start + u * first + u * u * (3 * (end - start) - 2 * first - last)
    return moved + u**3 * (2 * (start - end) + first + last)


def _nearest_turn(turn: Float, expected: Float) -> Float:
    """Return the rotation vector of the same rotation as `turn` that is nearest to the one expected."""
    angle = float(np.linalg.norm(turn))
    if angle < SMALL:
        length = float(np.linalg.norm(expected))
        whole = 2 * np.pi * round(length / (2 * np.pi))
        return turn + (expected / length * whole if whole else 0)
    axis = turn / angle
    return turn + axis * (2 * np.pi * round(float(axis @ expected - angle) / (2 * np.pi)))


def exp(turn: Float) -> Float:
    """Return the rotation (3, 3) by the rotation vector (3,), radians (Rodrigues' formula)."""
    angle = float(np.linalg.norm(turn))
    k = cross_matrix(turn)
    sine = np.sinc(angle / np.pi)
    half = np.sinc(angle / (2 * np.pi))
    return np.asarray(np.eye(3) + sine * k + half * half / 2 * (k @ k))


def log(rotation: Float) -> Float:
    """Return the rotation vector (3,) of a rotation (3, 3), of 0 to pi radians."""
    from scipy.spatial.transform import Rotation  # not above: scipy is slow to load, and few need it

    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())


def cross_matrix(vector: Float) -> Float:
    """Return the matrix (3, 3) by which a product is the cross product with `vector` (3,)."""
    x, y, z = vector
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedRates:
    """Rates that splines through all samples have there, and how far splines through every other sample miss those
    between: of places in their unit, of attitudes in radians."""

    velocities: Float
    rates: Float
    """(N, 3) radians a second, in the axes in which the places are."""
    missed: float
    missed_rad: float


def fitted_rates(times: Float, rotations: Float, places: Float) -> FittedRates | None:
    """Fit the rates of N states at `times` (N,), seconds, attitudes (N, 3, 3) and places (N, 3): those of cubic
    splines. None where the states do not follow one another smoothly, or are too few to say so."""
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation, RotationSpline

    if len(times) < FEWEST:
        return None
    attitudes = Rotation.from_matrix(rotations)
    kept, left = slice(None, None, 2), slice(1, (len(times) - 1) // 2 * 2, 2)
    off = CubicSpline(times[kept], places[kept])(times[left]) - places[left]
    turned = RotationSpline(times[kept], attitudes[kept])(times[left]).inv() * attitudes[left]
    missed, missed_rad = float(np.linalg.norm(off, axis=1).max()), float(turned.magnitude().max())
    steps = max(float(np.linalg.norm(b - a)) for a, b in pairwise(places))
    turns = float((attitudes[:-1].inv() * attitudes[1:]).magnitude().max())
    if missed > SMOOTH * steps + STILL_M or missed_rad > SMOOTH * turns + STILL_RAD:
        return None
    velocities = CubicSpline(times, places)(times, 1)
    rates = attitudes.apply(RotationSpline(times, attitudes)(times, 1))
    return FittedRates(velocities=np.asarray(velocities), rates=np.asarray(rates), missed=missed, missed_rad=missed_rad)
