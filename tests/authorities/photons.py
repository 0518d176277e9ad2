"""Light of a flat planet by photons: each is followed through air that scatters by Rayleigh's law, and off the ground.

At each turn a photon adds what of it goes straight to the eye from there, so that a hundred thousand are enough.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def reflectance_seen_from_above(
    depth: float, albedo: float, sun: float, rng: np.random.Generator, photons: int = 100_000
) -> float:
    """Return pi times the radiance straight up, over the irradiance of level ground without air.

    depth: optical depth of the air · albedo: of Lambert's ground · sun: cosine of its zenith angle
    """
    deep = -np.log(rng.random(photons)) * sun  # optical depth of each one's next turn
    way = np.repeat(np.array([[np.sqrt(1 - sun**2)], [0.0], [-sun]]), photons, axis=1)
    weight, total = np.ones(photons), 0.0
    while len(deep) and weight.max() > 1e-4:
        ground = deep >= depth
        total += float((weight[ground] * albedo).sum()) * np.exp(-depth)
        total += float((weight * rayleigh(way[2]) * np.exp(-deep))[~ground].sum()) * np.pi
        way = np.where(ground, _off_ground(len(deep), rng), _scattered(way, rng))
        weight = np.where(ground, weight * albedo, weight)
        deep = np.where(ground, depth, deep) + np.log(rng.random(len(deep))) * way[2]
        inside = (deep >= 0) & (weight > 0)
        deep, way, weight = deep[inside], way[:, inside], weight[inside]
    return total / photons


def rayleigh(cosine: Array) -> Array:
    """Return the share per steradian that is turned by an angle of that cosine."""
    return np.asarray((1 + cosine**2) * 3 / (16 * np.pi))


def _off_ground(count: int, rng: np.random.Generator) -> Array:
    up, turn = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    flat = np.sqrt(1 - up**2)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), up])


def _scattered(way: Array, rng: np.random.Generator) -> Array:
    """Return unit vectors (3, N) turned from `way` by angles of Rayleigh's law, drawn by the inverse of its sum."""
    count = way.shape[1]
    drawn = 4 * rng.random(count) - 2
    root = np.sqrt(1 + drawn**2)
    cosine, turn = np.cbrt(drawn + root) + np.cbrt(drawn - root), 2 * np.pi * rng.random(count)
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    steep = np.abs(way[2]) > 0.9
    other = np.stack([steep, np.zeros(count), ~steep]).astype(float)
    across = np.cross(way, other, axis=0)
    across /= np.linalg.norm(across, axis=0)
    return np.asarray(cosine * way + sine * (np.cos(turn) * across + np.sin(turn) * np.cross(way, across, axis=0)))
