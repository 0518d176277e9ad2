"""A bulge: the flat faces of a piece swell outwards, as a blanket or a warped panel does, and stay at their borders.

On a face with the border C, a point lies inside by f = (integral over C of ds / r^3)^(-1/2), which is smooth, 0 at the
border, and grows like the distance to it. With t as f over its greatest value, the face swells by t^2 (3 - 2 t)
along its normal, so that it leaves its border without a crease.
"""

import math

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.splitting import EDGES, Int
from spin_usd.geometry.triangles import areas, cross, dot, normals_of, unit_vectors

ACROSS = 24  # edges over the breadth of a square that has as much area as the piece
SAME_PLANE = np.cos(np.radians(0.5))  # between the normals of neighbours in one face
AT_BORDER = 1e-9  # of the piece's size
AT_ONCE = 2**20


def longest_edge(points: Float, corners: Int) -> float:
    """Return the length from which edges of the piece are split."""
    return math.sqrt(areas(points[corners]).sum()) / ACROSS


def flat_faces(points: Float, corners: Int) -> Int:
    """Return (T,) the number of each triangle's flat face: neighbours in one plane, from 0."""
    from scipy.sparse import coo_array  # not above: scipy is slow to load, and few need it
    from scipy.sparse.csgraph import connected_components

    edges, triangle = _edges(points, corners)
    order = np.lexsort((triangle, edges))
    edges, triangle = edges[order], triangle[order]
    normals = unit_vectors(normals_of(points, corners))
    first, second = triangle[:-1], triangle[1:]
    joined = (edges[:-1] == edges[1:]) & (dot(normals[first], normals[second]) > SAME_PLANE)
    count = len(corners)
    graph = coo_array((np.ones(joined.sum()), (first[joined], second[joined])), (count, count))
    faces: Int = connected_components(graph, directed=False)[1].astype(np.int64)
    return faces


def _edges(points: Float, corners: Int) -> tuple[Int, Int]:
    """Return of all edges of triangles (3 T,) a number that equal ones share, and their triangles."""
    place = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1)
    ends = np.sort(place[corners][:, EDGES].reshape(-1, 2), axis=1)
    return ends[:, 0] * len(points) + ends[:, 1], np.repeat(np.arange(len(corners)), 3)


def bulged(points: Float, corners: Int, faces: Int, height: float) -> Float:
    """Return the points (P, 3) after each flat face has swelled: the broadest by `height`, others in proportion to
    their breadth. faces: (T,) as `flat_faces` numbers them."""
    moves, size, broadest = np.zeros_like(points), float(np.ptp(points[corners], axis=(0, 1)).max()), 0.0
    for face in range(int(faces.max()) + 1):
        own = corners[faces == face]
        used = np.unique(own)
        depth = _depth(points[used], _border(points, own), size)
        if (top := float(depth.max())) > 0:
            share = depth / top
            rise = (top * share**2 * (3 - 2 * share))[:, None] * unit_vectors(normals_of(points, own).sum(0))
            moves[used[share > 0]] = rise[share > 0]
            broadest = max(broadest, top)
    return points + moves * (height / broadest) if broadest else points


def bulged_normals(normals: Float, before: Float, after: Float, corners: Int) -> Float:
    """Return the unit normals (T, 3, 3) at corners of triangles whose points moved from `before` to `after` (P, 3)."""
    change = _vertex_normals(after, corners) - _vertex_normals(before, corners)
    change[(before == after).all(1)] = 0
    return unit_vectors(normals + change[corners])


def _vertex_normals(points: Float, corners: Int) -> Float:
    """Return (P, 3) the mean directions of the triangles around each point, weighted by their areas."""
    across, found = np.repeat(normals_of(points, corners), 3, axis=0), np.empty_like(points)
    for i in range(3):
        found[:, i] = np.bincount(corners.reshape(-1), across[:, i], len(points))
    return unit_vectors(found)


def _border(points: Float, corners: Int) -> Float:
    """Return (E, 2, 3) the edges that only one of the triangles has."""
    numbers, _ = _edges(points, corners)
    _, first, count = np.unique(numbers, return_index=True, return_counts=True)
    border: Float = points[corners[:, EDGES].reshape(-1, 2)[first[count == 1]]]
    return border


def _depth(points: Float, border: Float, size: float) -> Float:
    """Return (N,) how deep inside the border (E, 2, 3) the points (N, 3) are; 0 on it, and all 0 for no border."""
    found = np.zeros(len(points))
    step = max(1, AT_ONCE // max(len(border), 1))
    for start in range(0, len(points) if len(border) else 0, step):
        some = slice(start, start + step)
        inverse, nearest = _of_border(points[some], border)
        found[some] = np.where(nearest > AT_BORDER * size, 1 / np.sqrt(inverse), 0)
    return found


def _of_border(points: Float, border: Float) -> tuple[Float, Float]:
    """Return (N,) the integral of ds / r^3 over the border (E, 2, 3), and the distance from it."""
    along = unit_vectors(border[:, 1] - border[:, 0])
    to_start, to_end = (border[None, :, i] - points[:, None] for i in range(2))
    t1, t2 = dot(to_start, along[None]), dot(to_end, along[None])
    off = np.linalg.norm(cross(to_start, np.broadcast_to(along, to_start.shape)), axis=-1)
    r1, r2 = np.linalg.norm(to_start, axis=-1), np.linalg.norm(to_end, axis=-1)
    nearest = np.where((t1 < 0) & (t2 > 0), off, np.minimum(r1, r2))
    with np.errstate(divide="ignore", invalid="ignore"):
        beside: NDArray[np.bool_] = t1 * t2 > 0  # past an end, where differences would cancel
        ways = np.where(beside, t2**2 - t1**2, t2 * r1 - t1 * r2)
        each = ways / (r1 * r2 * np.where(beside, t2 * r1 + t1 * r2, off**2))
    return np.nansum(each, axis=1), nearest.min(axis=1)
