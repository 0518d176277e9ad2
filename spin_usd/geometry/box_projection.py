"""Texture coordinates in metres for a surface that has none: regions of it, each projected along its own mean normal.

A region is flat or gently curved: its faces meet without a sharp edge and lie within MAX_TILT of its mean normal, so
that a pattern is stretched by 1 / cos(MAX_TILT) = 1.6 at most. What curves further, such as a tube, is cut into the
six sides of a box that lies along its largest flat face: there it is 1.8 at most. All regions measure from the body's
origin along its axes, so that a pattern goes on from one face to the next one in its plane.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.triangles import cross, dot, lengths

SHARP, FLAT, MAX_TILT, MAX_TILT_OF_SIDE = np.cos(np.radians((35.0, 1.0, 50.0, 55.0)))
"""Cosines of the angles at which an edge is sharp, below which faces are one plane, and of the largest tilts of an
uncut region and of one on a box's side, whose corner is at arccos(1 / sqrt(3)) = 54.7 degrees."""
STEEP = 0.95  # of the cosine to the body's z above which a region has its t along y instead
SNAP = 1e-4  # to the body's own axes, so that surfaces modelled along them are projected exactly along them
HASH = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
Int = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Polygons:
    """Faces of any number of corners."""

    points: Float
    """(P, 3) metres, body axes."""
    counts: Int
    """(F,) corners of each face."""
    indices: Int
    """(C,) the points of all corners, face by face."""

    @property
    def faces(self) -> Int:
        """The face (C,) of each corner."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @property
    def following(self) -> Int:
        """The corner (C,) that follows each around its face."""
        after = np.arange(1, len(self.indices) + 1)
        ends = np.cumsum(self.counts)
        after[ends - 1] = ends - self.counts
        return after

    @property
    def area_normals(self) -> Float:
        """(F, 3) normals, as long as the faces' areas."""
        first = (np.cumsum(self.counts) - self.counts)[self.faces]
        corners = self.points[self.indices]
        corners = corners - corners[first]  # from a corner of its own: a face far from the origin keeps its digits
        return _sums(cross(corners, corners[self.following]) / 2, self.faces)


def projected(polygons: Polygons) -> Float:
    """Return the texture coordinates (C, 2) of all corners, metres."""
    area_normals = polygons.area_normals
    region, side = _regions(polygons, area_normals)
    normal = _unit(_sums(area_normals, region))
    steep = _among(dot(_unit(area_normals), normal[region]) < MAX_TILT_OF_SIDE, region)
    normal[region[steep]] = side[steep]
    nearest = np.round(normal)
    close = (np.abs(normal - nearest) < SNAP).all(1)
    normal[close] = nearest[close]
    up = np.where(np.abs(normal[:, 2:]) > STEEP, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    t = _unit(up - dot(up, normal)[:, None] * normal)
    s = cross(t, normal)
    of, at = region[polygons.faces], polygons.points[polygons.indices]
    return np.stack([dot(at, s[of]), dot(at, t[of])], axis=-1)


def stretch(polygons: Polygons, st: Float) -> Float:
    """Return (F, 2) how much longer st (C, 2) is than the surface where it is longest and where it is shortest, by the
    first triangle of each face; 0 where that has no area."""
    first = np.cumsum(polygons.counts) - polygons.counts
    a, b, c = (polygons.points[polygons.indices[first + i]] for i in range(3))
    x, normal = _unit(b - a), _unit(cross(b - a, c - a))
    y = cross(normal, x)
    on_surface = np.stack(
        [np.stack([dot(b - a, x), dot(c - a, x)], -1), np.stack([dot(b - a, y), dot(c - a, y)], -1)], 1
    )
    in_st = np.stack([st[first + 1] - st[first], st[first + 2] - st[first]], axis=-1)
    whole = np.abs(np.linalg.det(on_surface)) > np.finfo(float).tiny
    found = np.zeros((len(first), 2))
    found[whole] = np.linalg.svd(in_st[whole] @ np.linalg.inv(on_surface[whole]), compute_uv=False)
    return found


def _regions(polygons: Polygons, area_normals: Float) -> tuple[Int, Float]:
    """Return the region (F,) of each face, and the normals (F, 3) of the sides by which curved ones are cut."""
    normals = _unit(area_normals)
    first, second = _neighbours(polygons)
    bend = dot(normals[first], normals[second])
    smooth = bend > SHARP
    first, second, bend = first[smooth], second[smooth], bend[smooth]
    whole = _components(first, second, len(normals))
    mean = _unit(_sums(area_normals, whole))
    curved = _among((dot(normals, mean[whole]) < MAX_TILT) & normals.any(1), whole)
    if not curved.any():
        return whole, np.zeros_like(normals)
    flat = bend > FLAT
    side = _sides(area_normals, _components(first[flat], second[flat], len(normals)), whole)
    same = ~curved[first] | (side[first] == side[second]).all(1)
    return _components(first[same], second[same], len(normals)), side


def _among(chosen: NDArray[np.bool_], of: Int) -> NDArray[np.bool_]:
    """Return (N,) whether any of the `chosen` (N,) is in the same group `of` (N,)."""
    found: NDArray[np.bool_] = np.bincount(of, chosen)[of] > 0
    return found


def _sides(area_normals: Float, plane: Int, whole: Int) -> Float:
    """Return the normal (F, 3) of that of the six sides of a box that each face lies on: the box lies along the largest
    plane of the `whole` (F,) that the face belongs to. All faces of a plane (F,) are on one side."""
    of_plane = _sums(area_normals, plane)
    size = lengths(of_plane)
    largest = np.zeros(whole.max() + 1, np.int64)
    order = np.argsort(size[plane], kind="stable")  # the last that is written stays
    largest[whole[order]] = plane[order]
    x = _unit(of_plane[largest])
    body = np.eye(3)[np.argmin(np.abs(x), axis=1)]
    y = _unit(body - dot(body, x)[:, None] * x)
    box = np.stack([x, y, cross(x, y)], axis=1)
    along = np.einsum("fij,fj->fi", box[whole], _unit(of_plane)[plane])
    axis, face = np.argmax(np.abs(along).round(6), axis=1), np.arange(len(whole))
    found: Float = box[whole, axis] * np.where(along[face, axis] < 0, -1.0, 1.0)[:, None]
    return found


def _neighbours(polygons: Polygons) -> tuple[Int, Int]:
    """Return pairs of faces that share an edge: both have its ends, at the same places if not the same points."""
    place = _places(polygons.points)[polygons.indices]
    ends = np.sort(np.stack([place, place[polygons.following]]), axis=0)
    key = ends[0] * (place.max() + 1) + ends[1]
    order = np.argsort(key, kind="stable")
    key, faces = key[order], polygons.faces[order]
    shared = key[1:] == key[:-1]
    return faces[:-1][shared], faces[1:][shared]


def _places(points: Float) -> Int:
    """Return the number (P,) of the place of each point: points of one place, as float32, have one number."""
    bits = (points.astype(np.float32) + np.float32(0)).view(np.uint32).astype(np.uint64)
    mixed = bits[:, 0] * HASH[0]
    for i in (1, 2):
        mixed = (mixed ^ (mixed >> np.uint64(29)) ^ bits[:, i]) * HASH[i]
    return np.unique(mixed, return_inverse=True)[1].reshape(-1).astype(np.int64)


def _components(first: Int, second: Int, count: int) -> Int:
    from scipy.sparse import coo_array  # not above: scipy is slow to load, and few need it
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(first), bool), (first, second)), shape=(count, count))
    found = connected_components(graph, directed=False)[1]
    return np.asarray(found, np.int64)


def _sums(values: Float, of: Int) -> Float:
    """Return (G, 3) the sums of the values (N, 3) of each group `of` (N,)."""
    return np.stack([np.bincount(of, values[:, i]) for i in range(3)], axis=-1)


def _unit(vectors: Float) -> Float:
    """Return vectors (N, 3) at length 1; 0 where they have no direction."""
    found: Float = vectors / np.maximum(lengths(vectors), np.finfo(float).tiny)[:, None]
    return found
