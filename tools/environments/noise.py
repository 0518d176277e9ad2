"""Fractal noise over the sphere, the same from run to run."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

Array = NDArray[np.float64]
LATTICE = 32  # points per side of the random cube that repeats
CORNERS = 1.6  # a mean of independent corners varies less than they do


def sphere(width: int, height: int) -> Array:
    """Return (3, height, width): the unit sphere's points at the centres of a latitude-longitude image's texels, north
    first, longitude 0 in the middle."""
    longitude = ((np.arange(width) + 0.5) / width * 2 - 1) * np.pi
    latitude = (0.5 - (np.arange(height) + 0.5) / height)[:, None] * np.pi
    z = np.sin(latitude) * np.ones(width)
    return np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), z])


def fractal(points: Array, *, seed: int, waves: float, octaves: int, gain: float = 0.5) -> Array:
    """Return noise (H, W) of variance about 1 at `points` (3, H, W): `waves` of its coarsest octave per radius, each
    further octave twice as fine and `gain` times as high."""
    rng = np.random.default_rng(seed)
    total, power = np.zeros(points.shape[1:]), 0.0
    for octave in range(octaves):
        lattice = rng.standard_normal((LATTICE,) * 3) * CORNERS
        at = points * (waves * 2**octave) + rng.random(3)[:, None, None] * LATTICE
        whole = np.floor(at)
        part = at - whole
        smooth = whole + part**3 * (part * (6 * part - 15) + 10)
        total += gain**octave * map_coordinates(lattice, smooth, order=1, mode="grid-wrap")
        power += gain ** (2 * octave)
    return np.asarray(total / np.sqrt(power))


def ramp(values: Array, low: float, high: float) -> Array:
    """Return 0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((values - low) / (high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))
