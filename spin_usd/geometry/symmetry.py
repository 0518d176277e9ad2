"""Symmetric places of a body: mirrored across a plane of its axes, or turned half around an axis."""

from collections.abc import Mapping

import numpy as np

from spin_usd.arrays import Float

SYMMETRIES: Mapping[str, tuple[int, int, int]] = {
    "mirror x (plane y z)": (-1, 1, 1),
    "mirror y (plane z x)": (1, -1, 1),
    "mirror z (plane x y)": (1, 1, -1),
    "half turn about x": (1, -1, -1),
    "half turn about y": (-1, 1, -1),
    "half turn about z": (-1, -1, 1),
}
"""The sign that each symmetry gives to x, y and z, by its name for people."""


def symmetric(points: Float, symmetry: str) -> Float:
    """Return where the `symmetry`, one of SYMMETRIES, takes the points (..., 3), in body axes."""
    return points * np.array(SYMMETRIES[symmetry], np.float64) + 0.0  # no negative zeros
