"""Polygons by their corners: which way they face, and how large they are."""

import numpy as np

from spin_usd.arrays import Float


def newell(polygons: Float) -> Float:
    """Twice the area vectors (..., 3) of polygons (..., n, 3). Source: M. E. Newell, in Sutherland et al. (1974)."""
    relative = polygons - polygons[..., :1, :]
    return np.cross(relative, np.roll(relative, -1, axis=-2)).sum(-2)
