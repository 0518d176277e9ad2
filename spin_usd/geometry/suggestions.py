"""Points that are suggested as keypoints: far from one another, and visible from many sides."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float


def spread(points: Float, count: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Return (K,) up to `count` of the `points` (N, 3), by their numbers: each the farthest from all before it. `rng`
    chooses the first. Points that coincide with one before them are left out."""
    return _farthest(points, np.ones(len(points)), int(rng.integers(len(points))), count)


def spread_and_seen(points: Float, share: Float, count: int) -> NDArray[np.intp]:
    """Return (K,) up to `count` of the `points` (N, 3), by their numbers: first the one with the largest `share` (N,)
    of views that show it, then each that is best by its share times its distance from all before it."""
    return _farthest(points, share, int(np.argmax(share)), count)


def random_directions(count: int, rng: np.random.Generator) -> Float:
    """Return (count, 3) unit vectors, equally likely all around."""
    height, turn = rng.uniform(-1, 1, count), rng.uniform(0, 2 * np.pi, count)
    across = np.sqrt(1 - height * height)
    return np.stack([across * np.cos(turn), across * np.sin(turn), height], -1)


def _farthest(points: Float, weight: Float, first: int, count: int) -> NDArray[np.intp]:
    chosen = [first]
    distance = np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < count and (distance * weight).max() > 0:
        chosen.append(int(np.argmax(distance * weight)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen, np.intp)
