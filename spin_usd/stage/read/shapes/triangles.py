"""Triangles of one prim, before they become part of the target's mesh."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError
from spin_usd.geometry.triangles import cross, normals_of, parts

Int = NDArray[np.int64]
# Twice the area over the longest edge squared: below this, rounding decides which way a triangle faces.
FLAT = 1e-14


@dataclass(frozen=True, kw_only=True, eq=False)
class Triangles:
    """A prim's triangles."""

    points: Float
    """(P, 3)"""
    corners: Int
    """(T, 3) into points, counter-clockwise seen from outside."""
    normals: Float
    """(T, 3, 3) unit, at the corners."""
    source: Int
    """(T,): the face of the prim from which each triangle comes."""
    primvars: Mapping[str, Float] = field(default_factory=dict)
    """(T, 3, C) at the corners, by name."""
    mended: Mapping[str, Int] = field(default_factory=dict)
    """Mended faces of the prim, by the code of `check`'s rule."""

    def transformed(self, matrix: Float, where: object) -> "Triangles":
        """Transform by the row-vector `matrix` (4, 4); normals by its inverse transpose. A mirror flips the winding."""
        linear = matrix[:3, :3]
        if np.array_equal(matrix, np.eye(4)):
            return self
        det = determinant(matrix, where)
        moved = replace(
            self,
            points=self.points @ linear + matrix[3, :3],
            normals=unit(self.normals @ np.linalg.inv(linear).T),
        )
        return moved if det > 0 else moved.flipped()

    def kept(self, chosen: NDArray[np.bool_]) -> "Triangles":
        """Keep only the `chosen` (T,) triangles."""
        return replace(
            self,
            corners=self.corners[chosen],
            normals=self.normals[chosen],
            source=self.source[chosen],
            primvars={name: values[chosen] for name, values in self.primvars.items()},
        )

    def flipped(self) -> "Triangles":
        """Flip the winding; normals and primvars stay at their corners, and normals keep their directions."""
        order = [0, 2, 1]
        return replace(
            self,
            corners=self.corners[:, order],
            normals=self.normals[:, order],
            primvars={name: values[:, order] for name, values in self.primvars.items()},
        )

    def with_area(self) -> "Triangles":
        """Drop the triangles without an area, which no ray can hit."""
        keep = np.empty(len(self.corners), bool)
        for some in parts(len(keep)):
            a, b, c = (self.points[self.corners[some, i]] for i in range(3))
            longest = np.max([((b - a) ** 2).sum(1), ((c - b) ** 2).sum(1), ((a - c) ** 2).sum(1)], axis=0)
            keep[some] = np.linalg.norm(cross(b - a, c - a), axis=1) > FLAT * longest
        return self if keep.all() else self.kept(keep)


def determinant(matrix: Float, where: object) -> float:
    """Compute the factor by which `matrix` (4, 4) scales volumes. Raises StageError where it is 0."""
    det = float(np.linalg.det(matrix[:3, :3]))
    if det == 0:
        raise StageError("is scaled to nothing", where=where, do="make it invisible, or give it a size")
    return det


def face_normals(points: Float, corners: Int) -> Float:
    """Compute unit normals (T, 3) of triangles (T, 3); (0, 0, 1) for zero area."""
    return unit(normals_of(points, corners))


def unit(vectors: Float) -> Float:
    """Normalise `vectors` (..., 3); (0, 0, 1) for zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), np.array([0.0, 0.0, 1.0]))
