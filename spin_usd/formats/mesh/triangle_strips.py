"""Triangle strips as triangles."""

import numpy as np
from numpy.typing import NDArray

RESTART = -1  # ends one strip and begins the next, in the PLY files of the Stanford repository


def strip_triangles(order: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return (F, 3) the triangles of the strip `order` (N,), all wound like the first; -1 in it begins another
    strip."""
    strips = np.split(np.asarray(order, np.int64), np.flatnonzero(order == RESTART))
    return np.concatenate([_triangles(strip[strip != RESTART]) for strip in strips])


def _triangles(strip: NDArray[np.int64]) -> NDArray[np.int64]:
    odd = np.arange(max(len(strip) - 2, 0)) % 2
    first = np.arange(len(odd))
    return np.stack([strip[first], strip[first + 1 + odd], strip[first + 2 - odd]], axis=1)
