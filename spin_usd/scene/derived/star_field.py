"""Random stars, as many and as bright as the real sky's, and the irradiance of a magnitude."""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.arrays import Float, frozen

# Irradiance of apparent bolometric magnitude 0, W/m2. Source: IAU 2015 resolution B2. The Sun's 1361 W/m2 are -26.83.
ZERO_MAGNITUDE = 2.518021002e-8
# Stars down to magnitude 6.5, and the slope of their number's decimal logarithm. The Yale Bright Star Catalogue (5th
# edition) has 9,096 down to about there; equally bright stars throughout space would give a slope of 0.6, dust and the
# galaxy's edge leave some 0.5 at these magnitudes (Allen's Astrophysical Quantities, star counts).
BRIGHT_STARS = 9000
BRIGHT_LIMIT = 6.5
SLOPE = 0.51


def irradiance(magnitude: ArrayLike) -> Float:
    """W/m2, over all wavelengths, of stars of apparent bolometric `magnitude`."""
    return ZERO_MAGNITUDE * 10 ** (-0.4 * np.asarray(magnitude, np.float64))


def star_count(limit: float) -> int:
    """Return the number of stars brighter than magnitude `limit`."""
    return round(BRIGHT_STARS * 10 ** (SLOPE * (limit - BRIGHT_LIMIT)))


@lru_cache(maxsize=2)
def random_stars(seed: int, limit: float) -> tuple[Float, Float]:
    """Directions (N, 3), unit, uniform over the sphere, and magnitudes (N,) of `star_count(limit)` stars."""
    rng, count = np.random.default_rng(seed), star_count(limit)
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # The share of the stars brighter than m is 10 ** (SLOPE * (m - limit)).
    magnitudes = limit + np.log10(1 - rng.random(count)) / SLOPE
    return frozen(directions), frozen(magnitudes)
