"""Triangles by their corners: their normals and areas.

Polygons and strips of triangles too.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

FACES_AT_ONCE = 2**15
RESTART = -1  # ends one strip and begins the next, in the PLY files of the Stanford repository


def normals(corners: Float) -> Float:
    """Return (..., 3) normals of the triangles `corners` (..., 3, 3), whose corners go around them counter-clockwise:
    as long as twice the area."""
    a, b, c = np.moveaxis(corners, -2, 0)
    return cross(b - a, c - a)


def cross(u: Float, v: Float) -> Float:
    """Return (..., 3) the cross products of the vectors (..., 3), equal to the bit to those of np.cross, which takes
    several times as long and makes copies of both."""
    found = np.empty(np.broadcast_shapes(u.shape, v.shape), np.result_type(u, v))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        np.multiply(u[..., j], v[..., k], out=found[..., i])
        found[..., i] -= u[..., k] * v[..., j]
    return found


def dot(u: Float, v: Float) -> Float:
    """Return (...) the dot products of the vectors (..., 3), equal to the bit to (u * v).sum(-1), which takes several
    times as long."""
    found: Float = u[..., 0] * v[..., 0]
    found += u[..., 1] * v[..., 1]
    found += u[..., 2] * v[..., 2]
    return found


def lengths(vectors: Float) -> Float:
    """Return (...) the lengths of the vectors (..., 3), equal to the bit to those of np.linalg.norm."""
    return np.sqrt(dot(vectors, vectors))


def normals_of(points: Float, faces: NDArray[np.integer]) -> Float:
    """Return (F, 3) `normals` of the triangles `faces` (F, 3), which index `points` (P, 3)."""
    found = np.empty((len(faces), 3))
    for some in parts(len(faces)):
        found[some] = normals(points[faces[some]])
    return found


def parts(count: int) -> Iterator[slice]:
    """Yield slices of `count` faces, few enough for a processor's cache to hold their corners: sums over all at once
    take gigabytes of a model of millions."""
    for start in range(0, count, FACES_AT_ONCE):
        yield slice(start, min(start + FACES_AT_ONCE, count))


def unit_normals(corners: Float) -> Float:
    """Return (..., 3) as `normals`, at length 1; 0 where there is no area."""
    along = normals(corners)
    along /= np.maximum(lengths(along), np.finfo(float).tiny)[..., None]
    return along


def areas(corners: Float) -> Float:
    """Return (...) areas of the triangles `corners` (..., 3, 3)."""
    area: Float = lengths(normals(corners)) / 2
    return area


def spread_points(corners: Float, count: int, rng: np.random.Generator) -> tuple[Float, NDArray[np.intp]]:
    """Return (count, 3) points spread evenly by area over the triangles `corners` (F, 3, 3), and (count,) the triangle
    of each. Some triangle must have an area."""
    ends = np.cumsum(areas(corners))
    places = (np.arange(count) + rng.random(count)) / count * ends[-1]  # one in each share of the area
    face = np.minimum(np.searchsorted(ends, places, side="right"), len(ends) - 1)
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
    a, b, c = np.moveaxis(corners[face], -2, 0)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), face


def distances_to(points: Float, corners: Float) -> Float:
    """Return (...) the distances of the points (..., 3) from the nearest points of the triangles (..., 3, 3)."""
    across = unit_normals(corners)
    inside = dot(across, across) > 0
    apart = np.full(inside.shape, np.inf)
    for start, end in zip(np.moveaxis(corners, -2, 0), np.moveaxis(np.roll(corners, -1, -2), -2, 0), strict=True):
        edge, towards = end - start, points - start
        inside &= dot(cross(edge, towards), across) >= 0
        share = np.clip(dot(towards, edge) / np.maximum(dot(edge, edge), np.finfo(float).tiny), 0, 1)
        np.minimum(apart, lengths(towards - share[..., None] * edge), out=apart)
    return np.where(inside, np.abs(dot(points - corners[..., 0, :], across)), apart)


def affine(matrices: Float, points: Float) -> Float:
    """Return (..., 3) the `points` (..., N, 3) moved by the matrices (..., 3, 4). Number by number, so that a point's
    place is the same to the bit however many are moved with it, which no matrix product promises."""
    x, y, z = (points[..., i : i + 1] for i in range(3))
    moved: Float = x * matrices[..., 0] + y * matrices[..., 1] + z * matrices[..., 2] + matrices[..., 3]
    return moved


def unit_vectors(vectors: Float) -> Float:
    """Return the vectors (..., 3) at length 1; 0 stays 0."""
    return vectors / np.maximum(lengths(vectors), np.finfo(float).tiny)[..., None]


def strip_triangles(order: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return (F, 3) the triangles of the strip `order` (N,), all wound like the first; -1 in it begins another
    strip."""
    strips = np.split(np.asarray(order, np.int64), np.flatnonzero(order == RESTART))
    return np.concatenate([_of_strip(strip[strip != RESTART]) for strip in strips])


def _of_strip(strip: NDArray[np.int64]) -> NDArray[np.int64]:
    odd = np.arange(max(len(strip) - 2, 0)) % 2
    first = np.arange(len(odd))
    return np.stack([strip[first], strip[first + 1 + odd], strip[first + 2 - odd]], axis=1)


def newell(polygons: Float) -> Float:
    """Twice the area vectors (..., 3) of polygons (..., n, 3). Source: M. E. Newell, in Sutherland et al. (1974)."""
    relative = polygons - polygons[..., :1, :]
    return np.cross(relative, np.roll(relative, -1, axis=-2)).sum(-2)
