"""Catmull-Clark subdivision, and points on its limit surface.

Sources: E. Catmull and J. Clark (1978); M. Halstead, M. Kass and T. DeRose (1993) for the limit positions.
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
    previous_corner,
    sharpness_after_step,
    sums,
)
from spin_usd.stage.read.shapes.triangles import Int


def refine(c: Cage) -> Cage:
    """Refine once: every face of n corners becomes n quadrangles."""
    faces, edges, n = c.face_of_corner, c.edges, len(c.points)
    face_points = _mean(c.points[c.indices], faces, len(c.counts))
    ends = c.points[edges].sum(1)
    around = sums(face_points[faces], c.face_edges, len(edges))
    smooth = (ends + around) / (2 + c.edge_faces)[:, None]
    edge_points = np.where((c.edge_sharpness > 0)[:, None], ends / 2, smooth)
    moved = _moved_points(c, face_points[faces])
    at_edge, at_face = n + c.face_edges, n + len(edges) + faces
    previous = previous_corner(c.counts)
    quads = np.stack([c.indices, at_edge, at_face, at_edge[previous]], 1)
    refined = cage(
        np.concatenate([moved, edge_points, face_points]),
        np.full(len(quads), 4),
        quads.reshape(-1),
        {},
        np.concatenate([sharpness_after_step(c.point_sharpness), np.zeros(len(edges) + len(c.counts))]),
    )
    return replace(refined, source=c.source[faces], edge_sharpness=inherited(c, refined))


def limit(c: Cage) -> Float:
    """Compute where the points (P, C) of a cage of quadrangles end after infinitely many steps."""
    quads = c.indices.reshape(-1, 4)
    valence = np.bincount(c.indices, minlength=len(c.points))[:, None]
    neighbours = neighbour_sum(c, np.ones(len(c.edges), bool))
    opposite = sums(c.points[quads[:, [2, 3, 0, 1]].reshape(-1)], c.indices, len(c.points))
    divisor = np.maximum(valence * (valence + 5), 1)
    smooth = (valence**2 * c.points + 4 * neighbours + opposite) / divisor
    crease = (4 * c.points + neighbour_sum(c, c.edge_sharpness > 0)) / 6
    return by_rule(c, smooth, crease)


def _moved_points(c: Cage, face_points: Float) -> Float:
    """Move the old points (P, 3) by one step; `face_points` (sum of counts, 3) has the face point of each corner."""
    valence = np.bincount(c.indices, minlength=len(c.points))[:, None]
    n = np.maximum(valence, 1)
    faces = sums(face_points, c.indices, len(c.points)) / n
    edges = np.bincount(c.edges.reshape(-1), minlength=len(c.points))[:, None]
    middles = (neighbour_sum(c, np.ones(len(c.edges), bool)) + edges * c.points) / np.maximum(2 * edges, 1)
    smooth = (faces + 2 * middles + (n - 3) * c.points) / n
    crease = (6 * c.points + neighbour_sum(c, c.edge_sharpness > 0)) / 8
    return by_rule(c, smooth, crease)


def _mean(values: Float, group: Int, count: int) -> Float:
    return sums(values, group, count) / np.bincount(group, minlength=count)[:, None]


CATMULL_CLARK = Scheme(corners=4, refine=refine, limit=limit)
