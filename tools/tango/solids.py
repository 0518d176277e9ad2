"""Solids with flat faces: boxes, prisms, trays, bars; each function returns one closed Shape."""

from collections.abc import Sequence

import numpy as np

from tango.shape import Array, Face, Point, Shape, surface


def box(low: Point, high: Point, material: str, *, bevel: float = 0.0) -> Shape:
    """A box between two corners, edges cut at 45 degrees by `bevel` where it is not 0."""
    if bevel == 0.0:
        (x0, y0, z0), (x1, y1, z1) = low, high
        return prism([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1, material)
    half = (np.array(high, float) - low) / 2
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    # Point 3 c + a: the corner c, on the face that looks along axis a.
    inset = half - bevel * (1 - np.eye(3))
    points = (signs[:, None, :] * inset[None]).reshape(-1, 3) + (np.array(low, float) + high) / 2
    faces = [_outwards(points, face) for face in _bevelled_faces(signs)]
    return surface(points, faces, material)


def _bevelled_faces(signs: Array) -> list[Face]:
    corner = {tuple(s): i for i, s in enumerate(signs.astype(int).tolist())}
    faces: list[Face] = [(3 * c, 3 * c + 1, 3 * c + 2) for c in range(8)]
    ring = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    for axis in range(3):
        for sign in (-1, 1):
            on = [corner[tuple(np.insert(pair, axis, sign).tolist())] for pair in ring]
            faces.append(tuple(3 * c + axis for c in on))
        a, b = (i for i in range(3) if i != axis)
        for pair in ring:
            lower, upper = (corner[tuple(np.insert(pair, axis, s).tolist())] for s in (-1, 1))
            faces.append((3 * lower + a, 3 * upper + a, 3 * upper + b, 3 * lower + b))
    return faces


def _outwards(points: Array, face: Face) -> Face:
    polygon = points[list(face)]
    normal = np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0])
    return face if normal @ (polygon.mean(axis=0) - points.mean(axis=0)) > 0 else face[::-1]


def prism(outline: Sequence[tuple[float, float]], z0: float, z1: float, material: str) -> Shape:
    """A convex outline (counter-clockwise in x, y) drawn out from z0 to z1."""
    n = len(outline)
    points = np.array([(x, y, z) for z in (z0, z1) for x, y in outline])
    top = [tuple(n + i for i in face) for face in _fan(n)]
    bottom = [face[::-1] for face in _fan(n)]
    sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    return surface(points, [*bottom, *top, *sides], material)


def _fan(n: int) -> list[Face]:
    """A convex polygon of n corners in quads, and a triangle where one corner is left."""
    return [tuple(k for k in (0, i, i + 1, i + 2) if k < n) for i in range(1, n - 1, 2)]


def tray(low: Point, high: Point, rim: float, depth: float, rim_material: str, floor_material: str) -> Shape:
    """A box whose top is lowered by `depth` inside a rim of this width."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    outer = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    inner = [(x0 + rim, y0 + rim), (x1 - rim, y0 + rim), (x1 - rim, y1 - rim), (x0 + rim, y1 - rim)]
    levels = [(outer, z0), (outer, z1), (inner, z1), (inner, z1 - depth)]
    points = np.array([(x, y, z) for outline, z in levels for x, y in outline])
    walls = [
        (4 * k + i, 4 * k + (i + 1) % 4, 4 * k + 4 + (i + 1) % 4, 4 * k + 4 + i) for k in range(3) for i in range(4)
    ]
    shape = surface(points, [*walls, (3, 2, 1, 0), (12, 13, 14, 15)], rim_material)
    return Shape(**{**vars(shape), "materials": (rim_material,) * 12 + (floor_material,) * 2})


def strut(start: Point, end: Point, across: Point, width: float, thickness: float, material: str) -> Shape:
    """A flat bar from start to end, half a width longer at both ends, its thickness along `across`, from 0 to +1."""
    along = np.subtract(end, start)
    length = float(np.linalg.norm(along))
    x, z = along / length, np.array(across, float)
    bar = box((-width / 2, -width / 2, 0.0), (length + width / 2, width / 2, thickness), material)
    return bar.moved(start, np.stack([x, np.cross(z, x), z], axis=1))
