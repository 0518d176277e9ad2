"""Polygon meshes to subdivide, with creases, corners and boundaries, and the rules that all schemes share.

Source: T. DeRose, M. Kass and T. Truong, "Subdivision surfaces in character animation" (1998) for creases.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.stage.read.shapes.triangles import Int, unit

INFINITE = 10.0  # USD: an edge of sharpness 10 or more stays sharp after any number of steps


@dataclass(frozen=True, kw_only=True, eq=False)
class Cage:
    """A polygon mesh to subdivide, whose sharpness is a whole number: how many steps an edge or point stays sharp."""

    points: Float
    """(P, 3), or other values (P, C) that follow the same rules."""
    counts: Int
    """(F,)"""
    indices: Int
    """(sum of counts,)"""
    source: Int
    """(F,): the face of the first cage from which each face comes."""
    edges: Int
    """(E, 2): sorted point pairs."""
    edge_sharpness: Float
    """(E,)"""
    point_sharpness: Float
    """(P,)"""
    face_edges: Int
    """(sum of counts,): the edge from each corner to the next."""
    edge_faces: Int
    """(E,): how many faces each edge has."""

    @property
    def face_of_corner(self) -> Int:
        """The face of each corner (sum of counts,)."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    def at_corners(self, values: Float) -> Float:
        """Return `values` (P, C) at the corners (F, n, C), where all faces have n corners."""
        corners: Float = values[self.indices.reshape(len(self.counts), -1)]
        return corners


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """A subdivision scheme."""

    corners: int
    """The corners of each face after one step."""
    refine: Callable[[Cage], Cage]
    """One step."""
    limit: Callable[[Cage], Float]
    """The limit of the points (P, C) of a refined cage after infinitely many steps."""


def cage(points: Float, counts: Int, indices: Int, creases: dict[tuple[int, int], float], corners: Float) -> Cage:
    """Build a cage with sharp edges {(low, high): sharpness} and point sharpness `corners` (P,).

    Edges with one face, or more than two, are always sharp.
    """
    following = next_corner(counts)
    pairs = np.sort(np.stack([indices, indices[following]], 1), 1)
    edges, face_edges = np.unique(pairs, axis=0, return_inverse=True)
    face_edges = face_edges.reshape(-1)
    edge_faces = np.bincount(face_edges, minlength=len(edges))
    sharpness = np.where(edge_faces == 2, 0.0, INFINITE)
    number = {(int(a), int(b)): i for i, (a, b) in enumerate(edges)} if creases else {}
    for pair, value in creases.items():
        if pair in number:
            sharpness[number[pair]] = max(sharpness[number[pair]], value)
    return Cage(
        points=points,
        counts=counts,
        indices=indices,
        source=np.arange(len(counts)),
        edges=edges,
        edge_sharpness=sharpness,
        point_sharpness=corners,
        face_edges=face_edges,
        edge_faces=edge_faces,
    )


def all_sharp(c: Cage) -> Cage:
    """Make everything sharp: refining such a cage is bilinear subdivision."""
    return replace(c, edge_sharpness=np.full(len(c.edges), INFINITE), point_sharpness=np.full(len(c.points), INFINITE))


def lonely_corners(counts: Int, indices: Int, point_count: int) -> Float:
    """Return a sharpness (P,) that fixes points of a single face (interpolateBoundary = edgeAndCorner)."""
    return np.where(np.bincount(indices, minlength=point_count) == 1, INFINITE, 0.0)


def corner_normals(c: Cage, points: Float) -> Float:
    """Compute unit normals (F, n, 3) at the corners of a refined cage's faces with `points` (P, 3): averaged over the
    faces around each point by area, but not across sharp edges."""
    p = c.at_corners(points)
    n = p.shape[1]
    area = np.cross(p[:, 2] - p[:, 0], p[:, -1] - p[:, 1])
    fan = _smooth_fans(c)
    total = sums(np.repeat(area, n, axis=0), fan, int(fan.max()) + 1)
    return unit(total[fan].reshape(-1, n, 3))


def _smooth_fans(c: Cage) -> Int:
    """Number the corners (4 F,), equally where corners of one point are joined by edges that are not sharp."""
    from scipy.sparse import coo_array  # not above: scipy is slow to load, and few need it
    from scipy.sparse.csgraph import connected_components

    following = next_corner(c.counts)
    corner = np.flatnonzero(c.edge_sharpness[c.face_edges] == 0)
    pairs = corner[np.argsort(c.face_edges[corner], kind="stable")].reshape(-1, 2)  # such edges have two faces
    a, b = pairs[:, 0], pairs[:, 1]
    flipped = c.indices[a] == c.indices[b]  # two faces that disagree about their winding run the same way
    near, far = np.where(flipped, b, following[b]), np.where(flipped, following[b], b)
    rows, columns = np.concatenate([a, following[a]]), np.concatenate([near, far])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(c.indices), len(c.indices)))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def by_rule(c: Cage, smooth: Float, crease: Float) -> Float:
    """Choose each point's rule: smooth with fewer than two sharp edges, crease with two; with more it stays, as do
    sharp points and points without faces."""
    sharp = np.bincount(c.edges[c.edge_sharpness > 0].reshape(-1), minlength=len(c.points))
    stays = (sharp > 2) | (c.point_sharpness > 0) | (np.bincount(c.indices, minlength=len(c.points)) == 0)
    return np.where(stays[:, None], c.points, np.where((sharp == 2)[:, None], crease, smooth))


def inherited(parent: Cage, child: Cage) -> Float:
    """Return the sharpness of the child's edges: halves of a parent's edge inherit it, less one; others only by
    topology."""
    n, e = len(parent.points), len(parent.edges)
    # Numbers ascend, so the old end of a half edge comes first and its middle second.
    half = (child.edges[:, 0] < n) & (child.edges[:, 1] >= n) & (child.edges[:, 1] < n + e)
    sharpness = child.edge_sharpness.copy()
    sharpness[half] = np.maximum(sharpness[half], sharpness_after_step(parent.edge_sharpness)[child.edges[half, 1] - n])
    return sharpness


def sharpness_after_step(sharpness: Float) -> Float:
    """Return the sharpness after one step: one less, unless it is infinite."""
    return np.where(sharpness >= INFINITE, sharpness, np.maximum(sharpness - 1, 0))


def neighbour_sum(c: Cage, chosen: NDArray[np.bool_]) -> Float:
    """Sum the other ends (P, 3) of the chosen edges at each point."""
    a, b = c.edges[chosen, 0], c.edges[chosen, 1]
    n = len(c.points)
    return sums(c.points[np.concatenate([b, a])], np.concatenate([a, b]), n)


def sums(values: Float, group: Int, count: int) -> Float:
    """Sum `values` (N, C) by `group` (N,), to (count, C)."""
    return np.stack([np.bincount(group, values[:, i], minlength=count) for i in range(values.shape[1])], 1)


def next_corner(counts: Int) -> Int:
    """Return for each corner, in the faces' order, the index of the next corner of its face."""
    ends = np.cumsum(counts)
    following = np.arange(1, int(counts.sum()) + 1)
    following[ends - 1] = ends - counts
    return following


def previous_corner(counts: Int) -> Int:
    """Return for each corner, in the faces' order, the index of the previous corner of its face."""
    following = next_corner(counts)
    previous = np.empty_like(following)
    previous[following] = np.arange(len(following))
    return previous
