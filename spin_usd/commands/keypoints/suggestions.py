"""Suggestions of keypoints for a target, reproducible from a seed."""

from enum import StrEnum

import numpy as np

from spin_usd.arrays import Float
from spin_usd.commands.keypoints.shown_target import ShownTarget
from spin_usd.geometry.suggestions import random_directions, spread, spread_and_seen

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
