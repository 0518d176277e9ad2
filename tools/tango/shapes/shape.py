"""A closed surface in pieces: points, faces (triangles and quads), and what each face corner and face carries."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Face: TypeAlias = tuple[int, ...]
Point: TypeAlias = Sequence[float] | Array

HALF_TURN = np.diag([-1.0, -1.0, 1.0])  # about z


@dataclass(frozen=True, kw_only=True)
class Shape:
    """points (P, 3) metres; faces counter-clockwise seen from outside; normals (C, 3) and st (C, 2) for each face
    corner in order; one material name per face."""

    points: Array
    faces: tuple[Face, ...]
    normals: Array
    st: Array
    materials: tuple[str, ...]

    def moved(self, by: Point, rotation: Array | None = None) -> Self:
        """Rotated by a proper rotation (3, 3), then shifted; st stays as it is, so copies share it."""
        R = np.eye(3) if rotation is None else rotation
        return replace(self, points=self.points @ R.T + np.array(by), normals=self.normals @ R.T)


def surface(
    points: Array, faces: Iterable[Face], material: str, *, crease: float = 35.0, st: Array | None = None
) -> Shape:
    """A Shape from points and faces: normals smooth across edges flatter than `crease` (degrees), st projected along
    the axis that each face looks along most, in metres, unless given."""
    faces = tuple(faces)
    flat = np.array([area_vector(points[list(face)]) for face in faces])
    return Shape(
        points=points,
        faces=faces,
        normals=_corner_normals(faces, flat, np.cos(np.radians(crease))),
        st=projected(points, faces, flat) if st is None else st,
        materials=(material,) * len(faces),
    )


def joined(shapes: Iterable[Shape]) -> Shape:
    """All of them as one Shape; nothing is merged."""
    shapes = tuple(shapes)
    starts = np.cumsum([0, *(len(shape.points) for shape in shapes)]).tolist()
    return Shape(
        points=np.concatenate([shape.points for shape in shapes]),
        faces=tuple(
            tuple(i + start for i in face) for start, s in zip(starts, shapes, strict=False) for face in s.faces
        ),
        normals=np.concatenate([shape.normals for shape in shapes]),
        st=np.concatenate([shape.st for shape in shapes]),
        materials=tuple(name for shape in shapes for name in shape.materials),
    )


def area_vector(polygon: Array) -> Array:
    """Newell: along the normal, as long as the area; also for quads that are not flat."""
    return np.cross(polygon, np.roll(polygon, -1, axis=0)).sum(axis=0) / 2


def _corner_normals(faces: tuple[Face, ...], flat: Array, cos_crease: float) -> Array:
    unit = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    around: dict[int, list[int]] = {}
    for index, face in enumerate(faces):
        for point in face:
            around.setdefault(point, []).append(index)
    normals = []
    for index, face in enumerate(faces):
        for point in face:
            near = [i for i in around[point] if unit[i] @ unit[index] >= cos_crease - 1e-9]
            normals.append(flat[near].sum(axis=0))
    total = np.array(normals)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def split(polygon: Face) -> list[Face]:
    """A convex polygon in quads, and a triangle where one corner is left."""
    n = len(polygon)
    return [tuple(polygon[k] for k in (0, i, i + 1, i + 2) if k < n) for i in range(1, n - 1, 2)]


def projected(points: Array, faces: tuple[Face, ...], flat: Array) -> Array:
    """st of each face corner, in metres: `flat` (F, 3) says along which axis each face looks most."""
    axes = ((1, 2), (0, 2), (0, 1))
    return np.concatenate(
        [points[list(face)][:, axes[int(np.abs(n).argmax())]] for face, n in zip(faces, flat, strict=True)]
    )
