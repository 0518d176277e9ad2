"""Suggestions of keypoints for a target, reproducible from a seed."""

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.commands.keypoints.shown_target import ShownTarget

VIEWS = 64  # from which points are looked at: the share of views that show one is good to a sixteenth
MAX_CANDIDATES = 4000  # vertices that are looked at: a second or so


class SuggestionMethod(StrEnum):
    """How keypoints are suggested: the points of the convex hull that are farthest apart, or vertices far apart that
    many random views show."""

    HULL = "far apart on the hull"
    SEEN = "seen from many sides"


def suggest(target: ShownTarget, method: SuggestionMethod, count: int, seed: int) -> Float:
    """Return up to `count` points (K, 3) of the target, body axes, metres."""
    rng = np.random.default_rng(seed)
    if method is SuggestionMethod.HULL:
        hull = target.mesh.hull
        return hull[spread(hull, count, rng)]
    points = np.unique(target.mesh.used_points, axis=0)
    points = points[np.sort(rng.permutation(len(points))[:MAX_CANDIDATES])]
    share = target.seen_share(points, random_directions(VIEWS, rng))
    return points[spread_and_seen(points, share, count)]


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
