"""Chance in the detector: photons that arrive one by one, and pixels that differ.

Every purpose has a stream of its own, so that switching one kind of noise on does not change another. Names and
symbols are those of EMVA Standard 1288, "Standard for Characterization of Image Sensors and Cameras", release 4.0.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import frozen

SHOT, READ, PATTERN = range(3)
FEW = 12.0  # electrons, below which photons are counted by a true Poisson generator

Electrons = NDArray[np.float32]


def stream(seed: int, purpose: int) -> np.random.Generator:
    """Random numbers that depend on the picture's `seed` and the purpose alone."""
    return np.random.Generator(np.random.SFC64([seed, purpose]))


def counted(expected: Electrons, chance: np.random.Generator) -> Electrons:
    """Whole numbers of electrons, Poisson distributed about `expected`, of any shape and at least zero."""
    few = expected < FEW
    if few.all():
        return chance.poisson(expected).astype(np.float32)
    if not few.any():
        return _many(expected, chance)
    found = np.empty_like(expected)
    found[few] = chance.poisson(expected[few])
    found[~few] = _many(expected[~few], chance)
    return found


def _many(expected: Electrons, chance: np.random.Generator) -> Electrons:
    """Poisson by the Cornish-Fisher expansion of its quantiles: from 12 electrons up its mean and variance are exact to
    2e-5, its skewness to 2 %, and it differs from the true distribution by less than 5e-4 in total variation.

    The twelfth is what rounding a smooth distribution to whole numbers adds to its variance. Source: E. A. Cornish,
    R. A. Fisher, "Moments and cumulants in the specification of distributions" (1938).
    """
    z = chance.standard_normal(expected.shape, np.float32)
    sigma = np.sqrt(expected - np.float32(1 / 12))
    z2 = z * z
    found = (1 - z2) * z
    found /= 72 * sigma
    found += (z2 - 1) / 6
    found += sigma * z
    found += expected
    return np.asarray(np.maximum(np.rint(found, out=found), 0, out=found))


def pixel_gains(shape: tuple[int, ...], prnu: float, seed: int) -> NDArray[np.float32]:
    """Return (H, W, C) relative gain of each pixel: photo-response non-uniformity with standard deviation `prnu`, at
    least 0. The sensor's own pattern: the same in each of its pictures."""
    return np.asarray(np.maximum(1 + np.float32(prnu) * _pattern(shape, seed), 0))


@lru_cache(maxsize=2)
def _pattern(shape: tuple[int, ...], seed: int) -> NDArray[np.float32]:
    return frozen(stream(seed, PATTERN).standard_normal(shape, np.float32), np.float32)
