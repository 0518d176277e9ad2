"""Edges that are not knife-sharp: every edge of a polyhedron cut off by a fraction of a millimetre."""

from collections.abc import Collection, Sequence

import numpy as np

from tango.shapes.shape import Array, Face, Shape, area_vector, projected, split

Edge = tuple[int, int]

EDGE = 0.0005  # metres: what a deburred edge has


def bevelled(
    points: Array, faces: Sequence[Face], materials: Sequence[str], bevel: float, *, keep: Collection[int] = ()
) -> Shape:
    """Cut the edges of a closed polyhedron with flat, convex faces.

    Each face shrinks by `bevel` within its plane; a quad takes the place of each edge, a polygon that of each point.
    The flat faces keep their normals, and the bevels turn from one face's to the next one's: they shine as round edges
    do. Points in `keep` stay as the tips of what cuts their corners.
    """
    normals = np.array([area_vector(points[list(face)]) for face in faces])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corner = {(f, i): n for n, (f, i) in enumerate((f, i) for f, face in enumerate(faces) for i in face)}
    inner = [_inset(points, faces[f], i, normals[f], bevel) for f, i in corner]
    owner = [normals[f] for f, _ in corner]
    polygons = [(tuple(corner[f, i] for i in face), materials[f]) for f, face in enumerate(faces)]
    beside = {(i, j): f for f, face in enumerate(faces) for i, j in _edges(face)}
    for (i, j), f in beside.items():
        if i < j:
            g = beside[j, i]
            polygons.append(((corner[f, j], corner[f, i], corner[g, i], corner[g, j]), materials[f]))
    for point in range(len(points)):
        around = _around(point, faces, beside)
        ring = tuple(corner[f, point] for f in around)
        if point in keep:
            inner.append(points[point])
            outwards = np.unique(np.round(normals[around], 6), axis=0).sum(axis=0)
            owner.append(outwards / np.linalg.norm(outwards))
            tip = len(inner) - 1
            polygons += [((tip, a, b), materials[around[0]]) for a, b in _edges(ring)]
        else:
            polygons.append((ring, materials[around[0]]))
    return _shape(np.array(inner), np.array(owner), polygons)


def _shape(points: Array, normals: Array, polygons: Sequence[tuple[Face, str]]) -> Shape:
    """The Shape of polygons, whose corners have the normals of their points."""
    pieces = [(piece, material) for polygon, material in polygons for piece in split(polygon)]
    faces = tuple(piece for piece, _ in pieces)
    flat = np.array([area_vector(points[list(face)]) for face in faces])
    return Shape(
        points=points,
        faces=faces,
        normals=normals[[i for face in faces for i in face]],
        st=projected(points, faces, flat),
        materials=tuple(material for _, material in pieces),
    )


def _edges(face: Face) -> list[Edge]:
    return list(zip(face, face[1:] + face[:1], strict=True))


def _inset(points: Array, face: Face, point: int, normal: Array, bevel: float) -> Array:
    """A corner of a face, moved inwards by `bevel` from both of its edges."""
    at = face.index(point)
    here = points[point]
    after, before = (points[face[(at + step) % len(face)]] - here for step in (1, -1))
    after, before = after / np.linalg.norm(after), before / np.linalg.norm(before)
    inset: Array = here + bevel * (after + before) / (normal @ np.cross(after, before))
    return inset


def _around(point: int, faces: Sequence[Face], beside: dict[Edge, int]) -> list[int]:
    """The faces that meet at a point, counter-clockwise seen from outside."""
    first = next(f for f, face in enumerate(faces) if point in face)
    around = [first]
    while True:
        face = faces[around[-1]]
        before = face[face.index(point) - 1]
        following = beside[point, before]
        if following == first:
            return around
        around.append(following)
