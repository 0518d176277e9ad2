"""Distributions of rotations, as unit quaternions (w, x, y, z) with w not below zero."""

import math
from dataclasses import dataclass

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.sampling.distribution import DIGITS, Directions, rounded

UNIT = 1e-5  # by which the length of a quaternion that is given may differ from 1
STEPS = 60  # of bisection: a double has 53 bits

UnitQuaternion = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Attitudes:
    """Rotations, every one alike."""

    def sample(self, rng: np.random.Generator) -> UnitQuaternion:
        """Four normal numbers, normalised (Marsaglia 1972)."""
        q = rng.normal(size=4)
        return _rounded(q / np.linalg.norm(q))


@dataclass(frozen=True, kw_only=True)
class AttitudesAround:
    """Rotations at most `most` degrees from the rotation `around`, every one alike."""

    around: UnitQuaternion
    most: float

    def __post_init__(self) -> None:
        if len(self.around) != 4 or not abs(np.linalg.norm(self.around) - 1) <= UNIT:
            raise InputError(f"around is {list(self.around)}, no rotation", do="give a unit quaternion w, x, y, z")
        if not 0 <= self.most <= 180:
            raise InputError(f"most is {self.most:g} degrees", do="give 0 to 180")

    def sample(self, rng: np.random.Generator) -> UnitQuaternion:
        """Sample the angle by the share of all rotations that are nearer, (angle - sin angle) / pi; any axis."""
        whole = math.radians(self.most)
        angle = _angle_of(rng.random() * (whole - math.sin(whole)), whole)
        axis = np.array(Directions().sample(rng))
        turn = np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis / np.linalg.norm(axis))])
        return _rounded(product(turn, np.array(self.around) / np.linalg.norm(self.around)))


@dataclass(frozen=True, kw_only=True)
class Facing:
    """Rotations that bring `axis`, body frame, to a direction at least `least` and at most `most` degrees from
    `towards`, camera frame: all such directions alike, and every turn about them."""

    axis: tuple[float, float, float]
    towards: tuple[float, float, float] = (0.0, 0.0, -1.0)
    least: float = 0.0
    most: float

    def __post_init__(self) -> None:
        Directions(axis=self.axis)
        Directions(axis=self.towards, least=self.least, most=self.most)

    def sample(self, rng: np.random.Generator) -> UnitQuaternion:
        direction = np.array(Directions(axis=self.towards, least=self.least, most=self.most).sample(rng))
        turn = rng.uniform(0, math.pi)  # half of it
        roll = np.array([math.cos(turn), *(math.sin(turn) * direction)])
        return _rounded(product(roll, _shortest(np.array(self.axis, np.float64), direction)))


def product(a: Float, b: Float) -> Float:
    """Return Hamilton's product (4,) of quaternions: the rotation `b`, then `a`."""
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def _shortest(start: Float, end: Float) -> Float:
    """Return the quaternion (4,) of a shortest rotation of the direction `start` (3,) to `end` (3,)."""
    start, end = start / np.linalg.norm(start), end / np.linalg.norm(end)
    if start @ end < -1 + 1e-12:  # any axis across it will do
        return np.array([0.0, *np.linalg.svd(start[None])[2][1]])
    q = np.array([1 + start @ end, *np.cross(start, end)])
    return np.asarray(q / np.linalg.norm(q))


def _angle_of(share: float, most: float) -> float:
    """Return the angle up to `most`, radians, at which angle - sin(angle) is `share`."""
    low, high = 0.0, most
    for _ in range(STEPS):
        middle = (low + high) / 2
        low, high = (middle, high) if middle - math.sin(middle) < share else (low, middle)
    return (low + high) / 2


def _rounded(q: Float) -> UnitQuaternion:
    """Return the quaternion with w not below zero, in numbers that are the same on every machine."""
    w, x, y, z = (rounded(round(float(value), DIGITS)) for value in (q if q[0] >= 0 else -q))
    return w, x, y, z
