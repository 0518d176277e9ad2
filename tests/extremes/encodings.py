"""What a depth loses in the number that a file keeps of it, beside what arithmetic says that it may lose."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

RANGES = (0.05, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5)  # metres
HALF_SIZE = 0.5  # metres, of the target about its range
LARGEST_HALF = 65504.0
STEPS = 65535


@dataclass(frozen=True, kw_only=True)
class Encoding:
    """`kept` gives of depths z (N,) of one frame, metres, what a reader gets back; `bound`, the most by which that may
    be off, of the farthest and the nearest of them: infinite where the number cannot hold them."""

    name: str
    kept: Callable[[np.ndarray], np.ndarray]
    bound: Callable[[float, float], float]


def _half(z):
    with np.errstate(over="ignore"):
        return z.astype(np.float16).astype(float)


def _millimetres(z):
    return np.clip(np.rint(1000 * z), 0, STEPS) / 1000


def _scaled(z):
    return np.rint(z / z.max() * STEPS) / STEPS * z.max()


def _own_range(z):
    low, span = z.min(), np.ptp(z)
    return low + np.rint((z - low) / span * STEPS) / STEPS * span


def _beyond_middle(z):
    middle = (z.min() + z.max()) / 2
    return middle + (z - middle).astype(np.float32).astype(float)


# Half a step: of 24 and 11 bits, of the power of two that is no more than the number; of equal steps. What else a
# reader does in doubles is 2**-50 of the farthest at most.
DOUBLES = 2.0**-50
ENCODINGS = (
    Encoding(name="float32", kept=lambda z: z.astype(np.float32).astype(float), bound=lambda far, near: 2.0**-24 * far),
    Encoding(name="half", kept=_half, bound=lambda far, near: 2.0**-11 * far if far <= LARGEST_HALF else np.inf),
    Encoding(
        name="16-bit millimetres",
        kept=_millimetres,
        bound=lambda far, near: 5e-4 + DOUBLES * far if far <= STEPS / 1000 else np.inf,
    ),
    Encoding(name="16-bit, 0 to the farthest", kept=_scaled, bound=lambda far, near: far / STEPS / 2 + DOUBLES * far),
    Encoding(
        name="16-bit, nearest to farthest",
        kept=_own_range,
        bound=lambda far, near: (far - near) / STEPS / 2 + DOUBLES * far,
    ),
    Encoding(
        name="float32 beyond a double",
        kept=_beyond_middle,
        bound=lambda far, near: 2.0**-25 * (far - near) + DOUBLES * far,
    ),
)


def depths(away):
    """(N,) of a target of HALF_SIZE about `away`; half as far to twice as far where the camera is closer than that."""
    low, high = (away - HALF_SIZE, away + HALF_SIZE) if away > 2 * HALF_SIZE else (away / 2, 2 * away)
    return np.random.default_rng(0).uniform(low, high, 20_000)


def errors(encoding, away):
    """(N,) metres, and the bound."""
    z = depths(away)
    return np.abs(encoding.kept(z) - z), encoding.bound(float(z.max()), float(z.min()))
