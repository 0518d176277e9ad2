"""Veiling glare: a share of all light, bright or dim, is scattered far aside by lens surfaces and housing.

The halo's profile (1 + (r / core)^2) ** (-falloff / 2) is a mixture of Gaussians: with t = falloff / 2,
a^-t = integral of s^(t - 1) exp(-s a) ds / Gamma(t), so each s adds a Gaussian of variance core^2 / (2 s), and the
energies follow a Gamma distribution of t - 1. In log(s) the integrand is smooth and ends softly at both sides: there
the plain sum of equal steps converges exponentially.
"""

from functools import lru_cache

import numpy as np

from spin_usd.scene.sensor import Optics
from spin_usd.sensor.spread import Image, Scale, spread

STEP = float(np.log(2))  # of log(s)
NARROWEST, WIDEST = 1e-5, 1e-9  # shares of the energy at the ends that are left to the others
LARGEST = 4.0  # frame diagonals, beyond which a Gaussian leaves less than 1 % of its energy in the frame


def scatter(light: Image, optics: Optics) -> Image:
    """`light` with the share `optics.glare` of it in the halo. The halo is normalised over the infinite plane."""
    height, width = light.shape[:2]
    halo = halo_scales(optics.glare_core, optics.glare_falloff, LARGEST * float(np.hypot(width, height)))
    scattered = spread(light, [(variance, weight * optics.glare) for variance, weight in halo])
    scattered += np.float32(1 - optics.glare) * light
    return scattered


@lru_cache(maxsize=16)
def halo_scales(core: float, falloff: float, widest: float) -> tuple[Scale, ...]:
    """Return the Gaussians that the halo is made of; those with a standard deviation above `widest` pixels are
    skipped."""
    from scipy.special import gammainccinv, gammaincinv  # not above: scipy is slow to load, and few need it

    shape = falloff / 2 - 1
    first, last = gammaincinv(shape, WIDEST), gammainccinv(shape, NARROWEST)
    s = np.exp(np.arange(np.log(first), np.log(last) + STEP, STEP))
    energy = s**shape * np.exp(-s)
    scales = zip((core**2 / (2 * s)).tolist(), (energy / energy.sum()).tolist(), strict=True)
    return tuple((variance, weight) for variance, weight in scales if variance < widest**2)
