"""How foil crumples: heights of flat facets between sharp creases, at several scales, drawn down where it is held."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay

from tango.shapes.shape import Array

SCALES = ((0.080, 0.50), (0.036, 0.34), (0.019, 0.16))  # metres between the facets' corners, share of the height
HELD = 0.10  # share of the height that is left where a seam or a button holds the foil down
REACH = 0.030  # metres from there to where the foil is loose


def heights(at: Array, seed: int, held: Sequence[Array]) -> Array:
    """Heights (N,) of 0 to 1 over places (N, 2) in metres; `held`: distances (N,) from what holds the foil down."""
    loose = sum(share * _facets(at, scale, seed * 10 + k) for k, (scale, share) in enumerate(SCALES))
    nearest = np.min([np.full(len(at), REACH), *held], axis=0) / REACH
    return np.asarray(loose * (HELD + (1 - HELD) * nearest**2 * (3 - 2 * nearest)))


def fraction(*numbers: int) -> float:
    """Whole numbers scattered over 0 to 1 by a 32-bit multiply-and-shift hash: the same on every machine."""
    number = sum(n * factor for n, factor in zip(numbers, (73, 5179, 90283, 1009, 333667), strict=False)) + 1
    for _ in range(3):
        number = ((number >> 16) ^ number) * 0x45D9F3B & 0xFFFFFFFF
    return number / 0xFFFFFFFF


def _facets(at: Array, scale: float, seed: int) -> Array:
    """Heights of 0 to 1, linear on each triangle between points scattered `scale` apart."""
    low = np.floor(at.min(axis=0) / scale).astype(int) - 2
    high = np.ceil(at.max(axis=0) / scale).astype(int) + 3
    cells = [(i, j) for i in range(low[0], high[0]) for j in range(low[1], high[1])]
    sites = [(i + 0.9 * fraction(i, j, seed, 1), j + 0.9 * fraction(i, j, seed, 2)) for i, j in cells]
    surface = LinearNDInterpolator(Delaunay(np.array(sites) * scale), [fraction(i, j, seed, 3) for i, j in cells])
    found: Array = surface(at)
    return found
