"""Catmull-Clark subdivision of meshes with creases, corners and boundaries, and points on its limit surface.

Sources: E. Catmull and J. Clark (1978); T. DeRose, M. Kass and T. Truong, "Subdivision surfaces in character
animation" (1998) for creases; M. Halstead, M. Kass and T. DeRose (1993) for the limit positions.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from spin_usd.arrays import Float
from spin_usd.stage.triangles import Int, unit

INFINITE = 10.0  # USD: a sharpness of 10 or more never wears off


@dataclass(frozen=True, kw_only=True, eq=False)
class Cage:
    """A polygon mesh to subdivide. points (P, 3), or other values (P, C) that follow the same rules · counts (F,) ·
    indices (sum of counts,) · source (F,) the face of the first cage that each face is of · edges (E, 2) sorted point
    pairs · edge_sharpness (E,) · point_sharpness (P,). Sharpness is a whole number: how many steps an edge or point
    stays sharp."""

    points: Float
    counts: Int
    indices: Int
    source: Int
    edges: Int
    edge_sharpness: Float
    point_sharpness: Float
    face_edges: Int  # (sum of counts,) the edge from each corner to the next
    edge_faces: Int  # (E,) how many faces each edge has

    @property
    def face_of_corner(self) -> Int:
        return np.repeat(np.arange(len(self.counts)), self.counts)


def cage(points: Float, counts: Int, indices: Int, creases: dict[tuple[int, int], float], corners: Float) -> Cage:
    """A cage with sharp edges {(low, high): sharpness} and point sharpness `corners` (P,).

    Edges with one face, or more than two, are sharp for ever; so is a point with one face only.
    """
    following = _next_corner(counts)
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
    """The same cage with everything sharp: refining it is bilinear subdivision."""
    return replace(c, edge_sharpness=np.full(len(c.edges), INFINITE), point_sharpness=np.full(len(c.points), INFINITE))


def lonely_corners(counts: Int, indices: Int, point_count: int) -> Float:
    """Sharpness (P,) that keeps points of a single face where they are (interpolateBoundary = edgeAndCorner)."""
    return np.where(np.bincount(indices, minlength=point_count) == 1, INFINITE, 0.0)


def refine(c: Cage) -> Cage:
    """One step: every face of n corners becomes n quadrangles."""
    faces, edges, n = c.face_of_corner, c.edges, len(c.points)
    face_points = _mean(c.points[c.indices], faces, len(c.counts))
    ends = c.points[edges].sum(1)
    around = _sum(face_points[faces], c.face_edges, len(edges))
    smooth = (ends + around) / (2 + c.edge_faces)[:, None]
    edge_points = np.where((c.edge_sharpness > 0)[:, None], ends / 2, smooth)
    moved = _moved_points(c, face_points[faces])
    at_edge, at_face = n + c.face_edges, n + len(edges) + faces
    previous = _previous_corner(c.counts)
    quads = np.stack([c.indices, at_edge, at_face, at_edge[previous]], 1)
    refined = cage(
        np.concatenate([moved, edge_points, face_points]),
        np.full(len(quads), 4),
        quads.reshape(-1),
        {},
        np.concatenate([_worn(c.point_sharpness), np.zeros(len(edges) + len(c.counts))]),
    )
    return replace(refined, source=c.source[faces], edge_sharpness=_inherited(c, refined))


def limit(c: Cage) -> Float:
    """Where the points (P, C) of a cage of quadrangles end after endlessly many steps."""
    quads = c.indices.reshape(-1, 4)
    valence = np.bincount(c.indices, minlength=len(c.points))[:, None]
    neighbours = _neighbour_sum(c, np.ones(len(c.edges), bool))
    opposite = _sum(c.points[quads[:, [2, 3, 0, 1]].reshape(-1)], c.indices, len(c.points))
    divisor = np.maximum(valence * (valence + 5), 1)
    smooth = (valence**2 * c.points + 4 * neighbours + opposite) / divisor
    crease = (4 * c.points + _neighbour_sum(c, c.edge_sharpness > 0)) / 6
    return _by_rule(c, smooth, crease)


def corner_normals(c: Cage, points: Float) -> Float:
    """Unit normals (F, 4, 3) at the corners of quadrangles with `points` (P, 3): averaged over the faces around each
    point by area, but not across sharp edges."""
    quads = c.indices.reshape(-1, 4)
    p = points[quads]
    area = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    fan = _smooth_fans(c)
    total = _sum(np.repeat(area, 4, axis=0), fan, int(fan.max()) + 1)
    return unit(total[fan].reshape(-1, 4, 3))


def _smooth_fans(c: Cage) -> Int:
    """A number (4 F,) for each corner, equal where corners of one point are joined by edges that are not sharp."""
    following = _next_corner(c.counts)
    corner = np.flatnonzero(c.edge_sharpness[c.face_edges] == 0)
    pairs = corner[np.argsort(c.face_edges[corner], kind="stable")].reshape(-1, 2)  # such edges have two faces
    a, b = pairs[:, 0], pairs[:, 1]
    flipped = c.indices[a] == c.indices[b]  # two faces that disagree about their winding run the same way
    near, far = np.where(flipped, b, following[b]), np.where(flipped, following[b], b)
    rows, columns = np.concatenate([a, following[a]]), np.concatenate([near, far])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(c.indices), len(c.indices)))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _moved_points(c: Cage, face_points: Float) -> Float:
    """The old points (P, 3) after one step; `face_points` (sum of counts, 3) are those of each corner's face."""
    valence = np.bincount(c.indices, minlength=len(c.points))[:, None]
    n = np.maximum(valence, 1)
    faces = _sum(face_points, c.indices, len(c.points)) / n
    edges = np.bincount(c.edges.reshape(-1), minlength=len(c.points))[:, None]
    middles = (_neighbour_sum(c, np.ones(len(c.edges), bool)) + edges * c.points) / np.maximum(2 * edges, 1)
    smooth = (faces + 2 * middles + (n - 3) * c.points) / n
    crease = (6 * c.points + _neighbour_sum(c, c.edge_sharpness > 0)) / 8
    return _by_rule(c, smooth, crease)


def _by_rule(c: Cage, smooth: Float, crease: Float) -> Float:
    """Fewer than two sharp edges: smooth; two: on a crease; more, a sharp point or one without faces: it stays."""
    sharp = np.bincount(c.edges[c.edge_sharpness > 0].reshape(-1), minlength=len(c.points))
    stays = (sharp > 2) | (c.point_sharpness > 0) | (np.bincount(c.indices, minlength=len(c.points)) == 0)
    return np.where(stays[:, None], c.points, np.where((sharp == 2)[:, None], crease, smooth))


def _inherited(parent: Cage, child: Cage) -> Float:
    """Sharpness of the child's edges: halves of a parent's edge inherit it, less one; others only by topology."""
    n, e = len(parent.points), len(parent.edges)
    # Numbers ascend, so the old end of a half edge comes first and its middle second.
    half = (child.edges[:, 0] < n) & (child.edges[:, 1] >= n) & (child.edges[:, 1] < n + e)
    sharpness = child.edge_sharpness.copy()
    sharpness[half] = np.maximum(sharpness[half], _worn(parent.edge_sharpness)[child.edges[half, 1] - n])
    return sharpness


def _worn(sharpness: Float) -> Float:
    return np.where(sharpness >= INFINITE, sharpness, np.maximum(sharpness - 1, 0))


def _neighbour_sum(c: Cage, chosen: NDArray[np.bool_]) -> Float:
    """Sum (P, 3) of the other ends of the chosen edges at each point."""
    a, b = c.edges[chosen, 0], c.edges[chosen, 1]
    n = len(c.points)
    return _sum(c.points[np.concatenate([b, a])], np.concatenate([a, b]), n)


def _sum(values: Float, group: Int, count: int) -> Float:
    """Sums (count, C) of `values` (N, C) by `group` (N,)."""
    return np.stack([np.bincount(group, values[:, i], minlength=count) for i in range(values.shape[1])], 1)


def _mean(values: Float, group: Int, count: int) -> Float:
    return _sum(values, group, count) / np.bincount(group, minlength=count)[:, None]


def _next_corner(counts: Int) -> Int:
    """For each corner of faces laid end to end, the place of the next corner of its own face."""
    ends = np.cumsum(counts)
    following = np.arange(1, int(counts.sum()) + 1)
    following[ends - 1] = ends - counts
    return following


def _previous_corner(counts: Int) -> Int:
    following = _next_corner(counts)
    previous = np.empty_like(following)
    previous[following] = np.arange(len(following))
    return previous
