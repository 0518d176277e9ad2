"""Loop subdivision of triangles, and points on its limit surface.

Source: C. T. Loop, "Smooth subdivision surfaces based on triangles" (1987), including its limit positions.
"""

from dataclasses import replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.stage.read.shapes.cage import (
    Cage,
    Scheme,
    by_rule,
    cage,
    inherited,
    neighbour_sum,
    next_corner,
    previous_corner,
    sharpness_after_step,
    sums,
)


def refine(c: Cage) -> Cage:
    """Refine once: every triangle becomes four."""
    n, following, previous = len(c.points), next_corner(c.counts), previous_corner(c.counts)
    ends = c.points[c.edges].sum(1)
    opposite = sums(c.points[c.indices], c.face_edges[following], len(c.edges))
    edge_points = np.where((c.edge_sharpness > 0)[:, None], ends / 2, (3 * ends + opposite) / 8)
    at_edge = n + c.face_edges
    corner_faces = np.stack([c.indices, at_edge, at_edge[previous]], 1)
    triangles = np.concatenate([corner_faces.reshape(-1, 9), at_edge.reshape(-1, 3)], 1)
    refined = cage(
        np.concatenate([_moved_points(c), edge_points]),
        np.full(4 * len(c.counts), 3),
        triangles.reshape(-1),
        {},
        np.concatenate([sharpness_after_step(c.point_sharpness), np.zeros(len(c.edges))]),
    )
    return replace(refined, source=np.repeat(c.source, 4), edge_sharpness=inherited(c, refined))


def limit(c: Cage) -> Float:
    """Compute where the points (P, C) of a cage of triangles end after infinitely many steps."""
    valence = _valence(c)
    share = 1 / (3 / (8 * _share(valence)) + valence)
    smooth = (1 - valence * share) * c.points + share * neighbour_sum(c, np.ones(len(c.edges), bool))
    crease = (4 * c.points + neighbour_sum(c, c.edge_sharpness > 0)) / 6
    return by_rule(c, smooth, crease)


def _moved_points(c: Cage) -> Float:
    """Move the old points (P, C) by one step."""
    valence = _valence(c)
    share = _share(valence)
    smooth = (1 - valence * share) * c.points + share * neighbour_sum(c, np.ones(len(c.edges), bool))
    crease = (6 * c.points + neighbour_sum(c, c.edge_sharpness > 0)) / 8
    return by_rule(c, smooth, crease)


def _valence(c: Cage) -> Float:
    """Count the edges of each point (P, 1), at least one."""
    return np.maximum(np.bincount(c.edges.reshape(-1), minlength=len(c.points)), 1)[:, None].astype(np.float64)


def _share(valence: Float) -> Float:
    """Compute the weight of each neighbour of a point in one step."""
    share: Float = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / valence) / 4) ** 2) / valence
    return share


LOOP = Scheme(corners=3, refine=refine, limit=limit)
