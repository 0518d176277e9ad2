"""An Earth that is none: continents, climates and weather from noise, with the real one's albedos.

Albedos over the solar spectrum: ocean 0.06, forest 0.13, grass 0.2, desert 0.35, snow 0.7 (common textbook values, for
example Hartmann, Global Physical Climatology, table 4.2). Their colours are ours.
"""

import numpy as np

from environments.noise import Array, fractal, ramp, sphere

OCEAN = (0.045, 0.060, 0.085)
FOREST = (0.11, 0.14, 0.08)
GRASS = (0.21, 0.20, 0.13)
DESERT = (0.42, 0.33, 0.22)
ROCK = (0.20, 0.19, 0.18)
SNOW = (0.70, 0.71, 0.73)


def albedo(width: int, height: int) -> Array:
    """(height, width, 3) Lambert albedo, linear."""
    points = sphere(width, height)
    north = points[2]
    elevation = fractal(points, seed=4, waves=1.3, octaves=9, gain=0.6) - 0.35
    wet = fractal(points, seed=9, waves=2.0, octaves=7, gain=0.55) + 1.6 * _rain(north)
    roughness = fractal(points, seed=12, waves=16.0, octaves=5, gain=0.6)
    ground = _mixed(DESERT, GRASS, ramp(wet, -0.3, 0.6))
    ground = _mixed(ground, FOREST, ramp(wet, 0.5, 1.4))
    ground = _mixed(ground, ROCK, ramp(elevation + 0.1 * roughness, 0.9, 1.5))
    cold = np.abs(north) + 0.06 * elevation + 0.04 * roughness
    ground = _mixed(ground, SNOW, ramp(cold, 0.86, 0.93))
    ground = ground * (1 + 0.15 * roughness)[..., None]
    sea = _mixed(OCEAN, SNOW, ramp(np.abs(north) + 0.03 * roughness, 0.93, 0.97))
    return np.clip(_mixed(sea, ground, ramp(elevation, -0.02, 0.02)), 0, 1)


def clouds(width: int, height: int) -> Array:
    """(height, width, 1) opacity."""
    points = sphere(width, height)
    north = points[2]
    # Weather is stirred: each scale carries the finer ones along.
    for seed, waves, way in ((31, 2.0, 0.05), (41, 6.0, 0.015)):
        points = points + way * np.stack([fractal(points, seed=seed + i, waves=waves, octaves=3) for i in range(3)])
    sheets = fractal(points * np.array([1, 1, 1.6])[:, None, None], seed=51, waves=3.0, octaves=7, gain=0.6)
    cells = fractal(points, seed=61, waves=40.0, octaves=3, gain=0.8)
    cover = sheets + 0.3 * cells + 0.8 * _rain(north)
    return ramp(cover, -0.9, 2.3)[..., None]


def _rain(north: Array) -> Array:
    """How wet the climate is by the sine of latitude: the tropics and the westerlies' storms, with deserts between."""
    tropics = np.exp(-((north / 0.16) ** 2))
    storms = np.exp(-(((np.abs(north) - 0.82) / 0.17) ** 2))
    return np.asarray(tropics + 0.9 * storms - 0.45)


def _mixed(low: Array | tuple[float, ...], high: Array | tuple[float, ...], share: Array) -> Array:
    low, high = np.asarray(low, float), np.asarray(high, float)
    return np.asarray(low + (high - low) * share[..., None])
