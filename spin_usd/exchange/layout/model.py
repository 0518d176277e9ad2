"""What a body looks like without its poses: triangles, and the numbers that data sets give of them."""

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import hull_points

CHUNK = 1 << 22  # distances worked out at once


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """points (P, 3) float64, body axes, metres · faces (F, 3) int32 of them, counter-clockwise seen from outside."""

    points: Float
    faces: NDArray[np.int32]

    @classmethod
    def of(cls, mesh: Mesh) -> "Model":
        """Return the mesh with each of its instances in place, and without points that no face has."""
        pieces = list(mesh.placed)
        firsts = [0, *accumulate(len(points) for points, _ in pieces)]
        points = np.concatenate([points for points, _ in pieces])
        faces = np.concatenate([faces + first for (_, faces), first in zip(pieces, firsts, strict=False)])
        used, places = np.unique(faces, return_inverse=True)
        return cls(points=points[used], faces=places.reshape(-1, 3).astype(np.int32))

    @cached_property
    def hull(self) -> Float:
        """(N, 3) points whose convex hull is the model's."""
        return hull_points(self.points)


def diameter(points: Float) -> float:
    """Return the largest distance between two of the points (N, 3): of all, so give those of the convex hull."""
    near = points - points.mean(0)  # far from the origin the products would cancel
    squares = (near**2).sum(1)
    step = max(CHUNK // len(near), 1)
    found = 0.0
    for start in range(0, len(near), step):
        chunk = slice(start, start + step)
        apart = squares[chunk, None] + squares - 2 * near[chunk] @ near.T
        one, other = np.unravel_index(int(np.argmax(apart)), apart.shape)
        found = max(found, float(np.linalg.norm(near[start + one] - near[other])))
    return found
