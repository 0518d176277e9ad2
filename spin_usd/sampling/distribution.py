"""Distributions of numbers, directions and choices; `attitudes` has those of rotations.

Sampled numbers are rounded to DIGITS significant digits, so that mathematical libraries whose last bit differs give the
same text everywhere, and a reader of a layer sees whole numbers.
"""

import math
from functools import lru_cache
from statistics import NormalDist
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta, Struct

from spin_usd.errors import InputError

DIGITS = 9
MIN_SHARE = 1e-3  # of a normal distribution, that is left of it where it is cut

Degrees = Annotated[float, Meta(ge=0, le=180)]
Vector = tuple[float, float, float]
Numbers = Annotated[tuple[float, ...], Meta(min_length=1, max_length=4)]
Value = bool | int | float | str | Numbers


class Distribution(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="distribution"):
    """The source of sampled values, as specifications write it. Its fields are checked when it is made: a distribution
    without a possible value is an InputError."""

    unit: Annotated[
        Literal["m", "px", "deg", "deg/s", "1"] | None,
        Meta(description="Of the numbers, for readers: each has one unit."),
    ] = None

    def sample(self, rng: np.random.Generator) -> Value:
        raise NotImplementedError


def rounded(value: float) -> float:
    """`value` to DIGITS significant digits; no negative zero."""
    return float(f"{value:.{DIGITS}g}") + 0.0


class Fixed(Distribution, frozen=True, kw_only=True, tag="fixed"):
    """Always the same value."""

    value: Annotated[Value, Meta(description="The value.")]

    def sample(self, rng: np.random.Generator) -> Value:
        return self.value


class Uniform(Distribution, frozen=True, kw_only=True, tag="uniform"):
    """Every number from `low` to `high` alike."""

    low: Annotated[float, Meta(description="The least.")]
    high: Annotated[float, Meta(description="The greatest.")]

    def __post_init__(self) -> None:
        _check_range(self.low, self.high)

    def sample(self, rng: np.random.Generator) -> float:
        return rounded(rng.uniform(self.low, self.high))


class LogUniform(Distribution, frozen=True, kw_only=True, tag="log_uniform"):
    """Every ratio from `low` to `high` alike, both above zero."""

    low: Annotated[float, Meta(description="The least.")]
    high: Annotated[float, Meta(description="The greatest.")]

    def __post_init__(self) -> None:
        _check_range(self.low, self.high)
        if self.low <= 0:
            raise InputError(f"low is {self.low:g}, which has no logarithm", do="make it positive, or sample uniformly")

    def sample(self, rng: np.random.Generator) -> float:
        return rounded(math.exp(rng.uniform(math.log(self.low), math.log(self.high))))


class Normal(Distribution, frozen=True, kw_only=True, tag="normal"):
    """A normal distribution, of whose values only those from `low` to `high` count."""

    mean: Annotated[float, Meta(description="Its mean.")]
    sigma: Annotated[float, Meta(gt=0, description="Its standard deviation.")]
    low: Annotated[float, Meta(description="None is lower.")] = -math.inf
    high: Annotated[float, Meta(description="None is higher.")] = math.inf

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and 0 < self.sigma < math.inf):
            found = f"mean is {self.mean:g} and sigma {self.sigma:g}"
            raise InputError(found, do="make both finite, and sigma positive")
        if not self.low < self.high:
            found = f"no number lies between low {self.low:g} and high {self.high:g}"
            raise InputError(found, do="give a lower low or a higher high")
        law = NormalDist(self.mean, self.sigma)
        if law.cdf(self.high) - law.cdf(self.low) < MIN_SHARE:
            few = f"fewer than {MIN_SHARE:g} of all values"
            found = f"{few} about {self.mean:g} +- {self.sigma:g} are from {self.low:g} to {self.high:g}"
            raise InputError(found, do="move the range to where the distribution is")

    @property
    def ends(self) -> tuple[float, ...]:
        """The ends that it has."""
        return tuple(end for end in (self.low, self.high) if math.isfinite(end))

    def sample(self, rng: np.random.Generator) -> float:
        while True:  # it ends: MIN_SHARE
            value = rounded(rng.normal(self.mean, self.sigma))
            if self.low <= value <= self.high:
                return value


class Choice(Distribution, frozen=True, kw_only=True, tag="choice"):
    """One of `values`, in proportion to its weight."""

    values: Annotated[tuple[Value, ...], Meta(description="Values to choose from.", extra_json_schema={"minItems": 1})]
    weights: Annotated[
        tuple[Annotated[float, Meta(ge=0)], ...], Meta(description="How often each value is chosen, as ratios.")
    ] = ()
    together: Annotated[
        str, Meta(description="Another choice of as many values: each picture has the same position in both lists.")
    ] = ""

    def __post_init__(self) -> None:
        if not self.values:
            raise InputError("there is nothing to choose from", do="list some values")
        if self.weights and len(self.weights) != len(self.values):
            found = f"{len(self.weights)} weights are given for {len(self.values)} values"
            raise InputError(found, do="give one for each")
        if self.weights and not (min(self.weights) >= 0 and 0 < sum(self.weights) < math.inf):
            raise InputError(f"weights {list(self.weights)} are negative, infinite or all 0", do="make some positive")

    def sample(self, rng: np.random.Generator) -> Value:
        shares = np.cumsum(self.weights or [1.0] * len(self.values))
        return self.values[int(np.searchsorted(shares, rng.random() * shares[-1], side="right"))]


class Directions(Distribution, frozen=True, kw_only=True, tag="directions"):
    """Unit vectors, every direction alike, at least `least` and at most `most` degrees from `axis`."""

    axis: Annotated[Vector, Meta(description="The axis, camera axes; (0, 0, 1) is the boresight.")] = (0.0, 0.0, 1.0)
    least: Annotated[Degrees, Meta(description="Least angle from the axis, degrees.")] = 0.0
    most: Annotated[Degrees, Meta(description="Greatest angle from the axis, degrees.")] = 180.0

    def __post_init__(self) -> None:
        if not (0 <= self.least <= self.most <= 180 and 0 < np.linalg.norm(self.axis) < math.inf):
            found = f"no direction lies {self.least:g} to {self.most:g} degrees from {list(self.axis)}"
            raise InputError(found, do="give an axis, and angles from 0 to 180 with the lower first")

    def sample(self, rng: np.random.Generator) -> tuple[float, float, float]:
        """Sample one direction; equal solid angles are equally likely, because the cosine from the axis is uniform."""
        z = rng.uniform(math.cos(math.radians(self.most)), math.cos(math.radians(self.least)))
        turn, sine = rng.uniform(0, 2 * math.pi), math.sqrt(max(1 - z * z, 0.0))
        across, up, axis = axes_about(self.axis)
        direction = sine * math.cos(turn) * across + sine * math.sin(turn) * up + z * axis
        x, y, z = (rounded(round(float(value), DIGITS)) for value in direction)
        return x, y, z


def _check_range(low: float, high: float) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        do = "make both finite, the lower first"
        raise InputError(f"no number lies between low {low:g} and high {high:g}", do=do)


@lru_cache(maxsize=16)
def axes_about(axis: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return three orthogonal unit vectors, the last along `axis`."""
    z = np.array(axis, np.float64) / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return x, np.cross(z, x), z
