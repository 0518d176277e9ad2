"""A model as a mesh file has it: named parts with polygons, in body axes, and constant materials."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float, finite, frozen
from spin_usd.errors import GeometryError
from spin_usd.scene.material import Material


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshPart:
    """points (P, 3) metres · face_counts (F,) corners of each face, 3 or more · face_indices (C,) points of the
    corners, face after face · normals (C, 3) of the corners, or None where the file has none · face_material (F,)
    indices into the asset's materials, -1 for none.

    Raises GeometryError for NaN, no faces, faces of fewer than 3 corners, indices out of range.
    """

    name: str
    points: Float
    face_counts: NDArray[np.int32]
    face_indices: NDArray[np.int32]
    normals: Float | None
    face_material: NDArray[np.int32]

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", finite(self.points, (None, 3), f"points of part {self.name!r}"))
        for name in ("face_counts", "face_indices", "face_material"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.int32))
        faces, corners = len(self.face_counts), len(self.face_indices)
        if not faces:
            raise GeometryError(f"part {self.name!r} has no faces")
        if self.face_counts.min() < 3 or int(self.face_counts.sum(dtype=np.int64)) != corners:
            raise GeometryError(f"part {self.name!r} has faces of fewer than 3 corners, or corners of no face")
        if self.face_indices.min() < 0 or self.face_indices.max() >= len(self.points):
            worst = int(self.face_indices.max() if self.face_indices.min() >= 0 else self.face_indices.min())
            raise GeometryError(
                f"part {self.name!r} has a face with point {worst}, expected 0 to {len(self.points) - 1}"
            )
        if self.face_material.shape != (faces,):
            raise GeometryError(f"part {self.name!r} has {len(self.face_material)} materials for {faces} faces")
        if self.normals is not None:
            object.__setattr__(self, "normals", finite(self.normals, (corners, 3), f"normals of part {self.name!r}"))

    @property
    def face_starts(self) -> NDArray[np.intp]:
        """(F,) index of each face's first corner."""
        return np.concatenate([[0], np.cumsum(self.face_counts[:-1], dtype=np.intp)])


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshAsset:
    """A model from a mesh file. `notes` are sentences on what a user should know of how it was read."""

    name: str
    parts: tuple[MeshPart, ...]
    materials: tuple[Material, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.parts:
            raise GeometryError("the model has no faces")

    @property
    def faces(self) -> int:
        return sum(len(part.face_counts) for part in self.parts)

    @property
    def size(self) -> Float:
        """(3,) edges of the bounding box, metres."""
        points = np.concatenate([part.points[np.unique(part.face_indices)] for part in self.parts])
        return np.asarray(points.max(0) - points.min(0))
