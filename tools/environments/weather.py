"""Weather of no real day, from noise: belts by latitude, storms, fronts."""

import numpy as np

from environments.noise import Array, fractal, ramp, sphere

ACROSS_BANDS = np.array([[1, 0, 0.6], [0, 1, -0.5], [-1.92, 1.6, 3.2]])
"""How far points are apart for the bands along fronts: three times as far across them, oblique to the parallels."""


def clouds(width: int, height: int) -> Array:
    """Return the opacity (height, width, 1): belts by latitude, storms that turn as they do in their hemisphere,
    sheets, streaks and bands along fronts; scattered clouds where it is neither 0 nor 1."""
    points = sphere(width, height)
    north = points[2]
    turned = _in_storms(points)
    # Weather is stirred: each scale carries the finer ones along.
    for seed, waves, way in ((31, 2.0, 0.06), (41, 6.0, 0.02), (45, 17.0, 0.006)):
        turned = turned + way * np.stack([fractal(turned, seed=seed + i, waves=waves, octaves=3) for i in range(3)])
    sheets = fractal(turned * np.array([1, 1, 1.7])[:, None, None], seed=51, waves=2.6, octaves=8, gain=0.66)
    streaks = fractal(turned * np.array([1, 1, 4.0])[:, None, None], seed=57, waves=5.0, octaves=6, gain=0.7)
    fronts = 1 - np.abs(fractal(turned, seed=61, waves=4.0, octaves=5, gain=0.6))
    bands = fractal(np.einsum("ij,jhw->ihw", ACROSS_BANDS, turned), seed=71, waves=9.0, octaves=5, gain=0.65)
    # Storms smear what they carry; what grows in them since is as fine and as round as anywhere.
    tufts = fractal(0.5 * (points + turned), seed=81, waves=22.0, octaves=6, gain=0.8)
    cover = 0.8 * sheets + 0.3 * streaks + 0.4 * fronts + 0.5 * bands + 0.75 * tufts + 0.9 * _rain(north)
    return (0.92 * ramp(cover, -1.3, 2.3))[..., None]


def _in_storms(points: Array) -> Array:
    """Return the points (3, H, W) as some thirty storms have turned them: counterclockwise in the north, clockwise in
    the south, most of them in the belts of westerlies."""
    rng = np.random.default_rng(5)
    for number in range(34):
        tropical = number % 6 == 5
        north = np.sin(np.radians(rng.uniform(10, 22) if tropical else rng.uniform(32, 66)))
        north *= -1 if number % 2 else 1
        longitude, radius = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.08) if tropical else rng.uniform(0.1, 0.24)
        axis = np.array([np.cos(longitude), np.sin(longitude), 0]) * np.sqrt(1 - north**2) + (0, 0, north)
        distance = np.linalg.norm(points - axis[:, None, None], axis=0)
        angle = (
            np.sign(north)
            * rng.uniform(2.4, 4.4)
            * np.exp(-distance / (0.45 * radius))
            * np.exp(-((distance / (1.6 * radius)) ** 2))
        )
        points = _turned(points, axis, angle)
    return points


def _turned(points: Array, axis: Array, angle: Array) -> Array:
    """Return the points (3, H, W) turned about `axis` (3,) by `angle` (H, W), radians (Rodrigues)."""
    along = np.einsum("i,ihw->hw", axis, points)
    across = np.cross(axis, points, axisb=0, axisc=0)
    turned = points * np.cos(angle) + across * np.sin(angle) + axis[:, None, None] * (along * (1 - np.cos(angle)))
    return np.asarray(turned)


def _rain(north: Array) -> Array:
    """Return how wet the climate is by the sine of latitude: the tropics and the westerlies' storms, deserts
    between."""
    tropics = np.exp(-((north / 0.16) ** 2))
    storms = np.exp(-(((np.abs(north) - 0.8) / 0.2) ** 2))
    return np.asarray(tropics + 0.9 * storms - 0.45)
