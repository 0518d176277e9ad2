"""Light spread by Gaussians of any width. Beyond the frame all is black, unless it is `mirrored`; what falls there is
lost, and nothing else.

Narrow Gaussians are convolved at full resolution, wide ones at a half, a quarter ...: a halving and its doubling each
convolve with the binomial kernel (1, 4, 6, 4, 1) / 16, whose response is zero at the frequency that the halving folds
onto the mean, so that every pixel's light counts in full wherever it lies. Source of the pyramid: P. J. Burt, "Fast
filter transforms for image processing" (1981).
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]
"""(H, W), or (H, W, 3)."""
Scale = tuple[float, float]
"""A Gaussian's variance along each axis, pixels squared, and its weight."""

DIRECT = 10.0  # variance that is convolved at the resolution at hand; what is left to the next is then at least 2,
# for which the resolution at hand is fine enough
HALVING = 2.0  # variance of a halving and its doubling: 1 each
PAD = 8  # dark pixels around the frame before a halving: more than the radius of its kernels
EXACT = 2.0  # variance from which samples of a Gaussian have its variance, to 1e-15
KERNEL_SIGMAS = 6.0  # standard deviations to which a kernel extends
NEGLIGIBLE = 1e-8  # of a kernel's middle


def spread(light: Image, scales: Sequence[Scale]) -> Image:
    """Return the sum of `light` convolved with each Gaussian of `scales`, times its weight."""
    import cv2  # not above: cv2 is slow to load, and few need it

    spreading = np.zeros_like(light)
    for variance, weight in scales:
        if variance < DIRECT:
            spreading += convolved(light, variance, weight)
    wide = [((variance - HALVING) / 4, weight) for variance, weight in scales if variance >= DIRECT]
    if wide:
        height, width = light.shape[:2]
        right, below = PAD + width % 2, PAD + height % 2
        padded = cv2.copyMakeBorder(light, PAD, below, PAD, right, cv2.BORDER_CONSTANT)
        coarse = spread(np.asarray(cv2.pyrDown(padded), np.float32), wide)
        spreading += cv2.pyrUp(coarse)[PAD : PAD + height, PAD : PAD + width]
    return spreading


def convolved(light: Image, variance: float, weight: float = 1.0, *, mirrored: bool = False) -> Image:
    """Return `light` convolved at full resolution with a Gaussian, times `weight`. Beyond the rim it is dark, or
    `mirrored`."""
    import cv2  # not above: see spread

    kernel = gaussian(variance)
    border, down = cv2.BORDER_REFLECT if mirrored else cv2.BORDER_CONSTANT, kernel * np.float32(weight)
    return np.asarray(cv2.sepFilter2D(light, -1, kernel, down, borderType=border), np.float32)


@lru_cache(maxsize=256)
def gaussian(variance: float) -> Image:
    """Return (N,) samples of a Gaussian, of sum 1 and exactly that variance on the grid, however narrow.

    Samples of exp(-x^2 / (2 variance)) have that variance only from about a pixel up; below, a wider one is sampled.
    """
    n = np.arange(
        -int(KERNEL_SIGMAS * np.sqrt(variance) + KERNEL_SIGMAS),
        int(KERNEL_SIGMAS * np.sqrt(variance) + KERNEL_SIGMAS) + 1,
    )
    exponent = 1 / (2 * variance)
    if variance < EXACT:
        from scipy.optimize import brentq  # not above: scipy is slow to load, and few need it

        exponent = brentq(lambda e: _variance(n, e) - variance, exponent / 100, exponent, xtol=1e-15)
    samples = np.exp(-exponent * n**2)
    samples = samples[samples > NEGLIGIBLE]
    return np.asarray(samples / samples.sum(), np.float32)


def _variance(n: NDArray[np.int64], exponent: float) -> float:
    samples = np.exp(-exponent * n**2)
    return float((samples * n**2).sum() / samples.sum())
