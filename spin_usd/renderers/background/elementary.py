"""Our own exponential, arctangent and table of cosines, from operations whose every bit IEEE 754 defines.

numpy's and C libraries' differ in the last bit between processors; products, sums, quotients and square roots do not.
Their polynomials were fitted for least error over the interval at which each is used.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

Float32 = NDArray[np.float32]
_EXP2 = (1.0, 0.693147207, 0.240226515, 0.0555032722, 0.00961799458, 0.00134004317, 0.000154780047)  # to 2e-9
_ARCTAN = (  # of the square of a number between 0 and 1, to 9e-8
    0.999999911,
    -0.333320933,
    0.199713709,
    -0.140293938,
    0.0994268348,
    -0.0599035901,
    0.024556296,
    -0.00478021624,
)
LEAST = np.float32(-87)  # below it float32 has no normal numbers
TURN = 256  # steps of the table of cosines
STEP = (0.9996988186962042, 0.024541228522912288)  # cosine and sine of one of them


def exp(x: Float32) -> Float32:
    """Return e to the power of `x`, at most 87, to 3e-7 relative; results below 1e-38 become 1e-38."""
    y = np.maximum(x, LEAST)
    y = y * np.float32(1.44269504)
    whole = np.floor(y + np.float32(0.5))
    y -= whole
    exponent = whole.astype(np.int32)
    exponent += 127
    exponent <<= 23
    return np.asarray(_polynomial(y, _EXP2) * exponent.view(np.float32), np.float32)


def log(x: Float32) -> Float32:
    """Return the natural logarithm of positive numbers, to 2e-7."""
    part, exponent = np.frexp(x)
    s = (part - np.float32(0.70710678)) / (part + np.float32(0.70710678))
    series = s * _polynomial(s * s, (2.0, 2 / 3, 2 / 5, 2 / 7))
    return np.asarray(series + (exponent.astype(np.float32) - np.float32(0.5)) * np.float32(0.69314718), np.float32)


def arctan2(y: Float32, x: Float32) -> Float32:
    """Return the angle of the points (x, y), radians, to 4e-7; 0 at the origin."""
    wide, high = np.abs(x), np.abs(y)
    most = np.maximum(np.maximum(wide, high), np.float32(1e-30))
    ratio = np.minimum(wide, high) / most
    angle = ratio * _polynomial(ratio * ratio, _ARCTAN)
    angle = np.where(high > wide, np.float32(np.pi / 2) - angle, angle)
    angle = np.where(x < 0, np.float32(np.pi) - angle, angle)
    return np.asarray(np.copysign(angle, y), np.float32)


def arctan(ratio: Float) -> Float:
    """Return the arctangent of numbers between -2 and 2, radians, to 1e-7, with no jump."""
    inside = np.clip(ratio, -1, 1)
    # Beyond 1 it continues as a line: it is needed only where faces of a cube overlap.
    return np.asarray(inside * _polynomial(inside * inside, _ARCTAN) + (ratio - inside) * 0.5)


@lru_cache(maxsize=1)
def cosines() -> Float:
    """Return (TURN,) the cosines of a turn's steps, each of the product of the one before with STEP."""
    c, s, found = 1.0, 0.0, []
    for _ in range(TURN):
        found.append(c)
        c, s = c * STEP[0] - s * STEP[1], c * STEP[1] + s * STEP[0]
    return np.array(found)


def length(v: Float) -> float:
    """Return the length of the vector (3,)."""
    return float(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))


def rotated(matrix: Float, v: Sequence[Float | float]) -> list[Float]:
    """Return x, y, z of `matrix` (3, 3) times vectors, their x, y, z (N,) or single numbers: of sums in a fixed order,
    as BLAS's are not."""
    return [np.asarray(m[0] * v[0] + m[1] * v[1] + m[2] * v[2]) for m in matrix]


def _polynomial(x: NDArray[np.floating], coefficients: tuple[float, ...]) -> NDArray[np.floating]:
    total = x * x.dtype.type(coefficients[-1])
    for coefficient in coefficients[-2:0:-1]:
        total += x.dtype.type(coefficient)
        total *= x
    total += x.dtype.type(coefficients[0])
    return total
