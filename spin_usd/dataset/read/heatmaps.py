"""Heatmaps of keypoints, made of their places alone: no file could hold more."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import InputError


def heatmaps_of(pixels: Float, frame: tuple[int, int], *, size: tuple[int, int], sigma: float) -> NDArray[np.float32]:
    """Return (K, height, width) float32: around each of the `pixels` (K, 2) of a `frame` (width, height) a Gaussian of
    height 1, in maps of `size` (width, height).

    `sigma`: in pixels of the map. A map is of the whole frame, and has its pixels' centres at (c + 0.5, r + 0.5). It is
    0 all over where the place is outside the frame, or NaN. Raises InputError for a size or a sigma that is not
    positive.
    """
    if min(size) < 1 or not 0 < sigma < np.inf:
        raise InputError(f"heatmaps cannot be of size {size} and sigma {sigma}", do="make both positive")
    places = pixels * np.divide(size, frame)
    inside = ((places >= 0) & (places < size)).all(-1)
    x, y = (_falloff(places[:, axis], size[axis], sigma) for axis in (0, 1))
    return np.asarray(np.where(inside[:, None, None], y[:, :, None] * x[:, None, :], 0), np.float32)


def _falloff(places: Float, length: int, sigma: float) -> Float:
    """Return (K, length) of the Gaussian along one axis."""
    away = np.arange(length) + 0.5 - np.nan_to_num(places)[:, None]
    fallen: Float = np.exp(-(away**2) / (2 * sigma**2))
    return fallen
