"""Triangles split until no edge is longer than allowed, without cracks: an edge is halved for all triangles that have
it or for none."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import UnsupportedError
from spin_usd.stage.read.shapes.triangles import Int, Triangles, unit

MAX_TRIANGLES = 2**22
SAME = 1e-6  # of the longest extent: nearer points are merged; USD's float32 resolves 6e-8
# Corners 0 to 2 and the middles 3 to 5 of the edges 01, 12, 20, by which edges are halved (1, 2 and 4, added).
PATTERNS = (
    ((0, 1, 2),),
    ((0, 3, 2), (3, 1, 2)),
    ((0, 1, 4), (0, 4, 2)),
    ((3, 1, 4), (0, 3, 4), (0, 4, 2)),
    ((0, 1, 5), (5, 1, 2)),
    ((5, 0, 3), (3, 1, 2), (3, 2, 5)),
    ((4, 2, 5), (0, 1, 4), (0, 4, 5)),
    ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
)


def welded(triangles: Triangles) -> Triangles:
    """Merge points that differ only by rounding into the first of them."""
    from scipy.sparse import coo_array  # not above: scipy is slow to load, and few need it
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    points, place = np.unique(triangles.points + 0.0, axis=0, return_inverse=True)
    close = cKDTree(points).query_pairs(SAME * float(np.ptp(points, axis=0).max()), output_type="ndarray")
    links = coo_array((np.ones(len(close)), (close[:, 0], close[:, 1])), shape=(len(points),) * 2)
    cluster = connected_components(links, directed=False)[1].astype(np.int64)
    first = np.unique(cluster, return_index=True)[1]
    return replace(triangles, points=points[first], corners=cluster[place.reshape(-1)][triangles.corners])


def tessellated(triangles: Triangles, measure: Float, longest: float, where: object) -> tuple[Triangles, Int]:
    """Split welded `triangles` until no edge is longer than `longest`, measured between the coordinates `measure` (T,
    3, 2) of their corners. Returns them, and the original triangle (N,) of each.

    Normals and primvars are interpolated. Raises UnsupportedError beyond MAX_TRIANGLES.
    """
    parent = np.arange(len(triangles.corners))
    while True:
        lengths = np.linalg.norm(measure - np.roll(measure, -1, axis=1), axis=-1)
        halved, middle, points = _halved(triangles, lengths > longest)
        if not halved.any():
            return triangles, parent
        pattern = halved @ [1, 2, 4]
        count = sum(len(PATTERNS[p]) * n for p, n in enumerate(np.bincount(pattern)))
        if count > MAX_TRIANGLES:
            found = f"needs more than {MAX_TRIANGLES} triangles to follow the texels of its displacement"
            raise UnsupportedError(found, where=where, do="use a smaller image, or fewer repetitions of it")
        order = np.concatenate([np.repeat(np.flatnonzero(pattern == p), len(t)) for p, t in enumerate(PATTERNS)])
        local = np.concatenate([np.tile(t, (int((pattern == p).sum()), 1)) for p, t in enumerate(PATTERNS)])
        row = order[:, None]
        triangles = replace(
            triangles,
            points=points,
            corners=np.concatenate([triangles.corners, middle], 1)[row, local],
            normals=unit(_with_middles(triangles.normals)[row, local]),
            source=triangles.source[order],
            primvars={name: _with_middles(values)[row, local] for name, values in triangles.primvars.items()},
        )
        measure, parent = _with_middles(measure)[row, local], parent[order]


def _halved(triangles: Triangles, marked: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], Int, Float]:
    """Return which edges (T, 3) are halved, the points (T, 3) in their middles, and all points with those."""
    following = np.roll(triangles.corners, -1, axis=1)
    low, high = np.minimum(triangles.corners, following), np.maximum(triangles.corners, following)
    number = len(triangles.points)
    keys, edge = np.unique((low * number + high).reshape(-1), return_inverse=True)
    edge = edge.reshape(-1, 3)
    chosen = np.zeros(len(keys), bool)
    chosen[edge[marked]] = True
    new = np.cumsum(chosen) - 1 + number
    a, b = keys[chosen] // number, keys[chosen] % number
    points = np.concatenate([triangles.points, (triangles.points[a] + triangles.points[b]) / 2])
    return chosen[edge], np.where(chosen[edge], new[edge], 0), points


def _with_middles(values: Float) -> Float:
    """Return `values` (T, 3, C) at the corners, then in the middles of the edges, (T, 6, C)."""
    return np.concatenate([values, (values + np.roll(values, -1, axis=1)) / 2], 1)
