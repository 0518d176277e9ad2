"""Bootstrap intervals over pictures: pictures are drawn again, and not pixels, for a picture's pixels are alike."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.basics.arrays import Float

DRAWS = 2000
LEAST = 3  # values that have an interval
TAILS = (0.025, 0.975)

Interval = tuple[float, float]


def median_interval(values: ArrayLike) -> tuple[float, Interval]:
    """Return the median of the finite values (N,) and its 95 % interval; NaN without any."""
    return interval(np.asarray(values, np.float64), lambda drawn: np.median(drawn, axis=1))


def interval(values: Float, of: Callable[[Float], Float]) -> tuple[float, Interval]:
    """Return a statistic of the finite values (N,) and its 95 % interval. `of`: the statistic of each row (M, N)."""
    finite = values[np.isfinite(values)]
    if len(finite) < LEAST:
        return float(of(finite[None])[0]) if len(finite) else float("nan"), (float("nan"), float("nan"))
    drawn = np.random.default_rng(0).integers(len(finite), size=(DRAWS, len(finite)))
    low, high = np.quantile(of(finite[drawn]), TAILS)
    return float(of(finite[None])[0]), (float(low), float(high))
