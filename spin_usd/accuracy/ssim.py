"""Structural ssim of two images.

Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error visibility to structural
ssim", IEEE Transactions on Image Processing 13 (4), 2004, section III-C: an 11 x 11 Gaussian window of 1.5
pixels, K1 = 0.01, K2 = 0.03.
"""

import numpy as np

from spin_usd.arrays import Float

SIGMA_PX = 1.5
RADIUS_PX = 5
K1, K2 = 0.01, 0.03


def ssim(a: Float, b: Float, *, top: float) -> Float:
    """Return (H, W) of the images `a` and `b`, (H, W) or (H, W, C) with channels that are averaged, which reach from 0
    to `top`: 1 where the windows around a pixel are equal, less where not. Beyond its edge an image is mirrored."""
    c1, c2 = (K1 * top) ** 2, (K2 * top) ** 2
    mean_a, mean_b = _windowed(a), _windowed(b)
    both = mean_a * mean_b
    squares = mean_a * mean_a + mean_b * mean_b
    covariance = _windowed(a * b) - both
    variances = _windowed(a * a + b * b) - squares
    found = (2 * both + c1) * (2 * covariance + c2) / ((squares + c1) * (variances + c2))
    return found.mean(-1) if found.ndim == 3 else found


def _windowed(image: Float) -> Float:
    """Return the weighted mean around each pixel."""
    from scipy import ndimage  # not above: scipy is slow to load, and few need it

    return np.asarray(ndimage.gaussian_filter(image, SIGMA_PX, radius=RADIUS_PX, axes=(0, 1)), np.float64)
