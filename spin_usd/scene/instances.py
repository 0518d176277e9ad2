"""One shape in several places: kept once, moved on demand."""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, digest, finite, frozen
from spin_usd.errors import GeometryError
from spin_usd.geometry.triangles import affine, unit_vectors
from spin_usd.scene.shape import Shape

Value = TypeVar("Value", bound=np.generic)
MIRRORED_CORNERS = [0, 2, 1]  # a mirrored triangle's corners, so that they go counter-clockwise again


@dataclass(frozen=True, kw_only=True, eq=False)
class Instances:
    """The `shape` in K places. A face is identified by its place, 0 to K - 1, and its number in the shape."""

    shape: Shape
    """Its face_part are columns of `parts`, and its face_group is ignored."""
    matrices: Float
    """(K, 3, 4) from the shape's axes to the body's, metres, none of them flat."""
    parts: NDArray[np.uint16]
    """(K, C) part ids."""
    groups: NDArray[np.uint16]
    """(K,) numbers that light links name."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrices", finite(self.matrices, (None, 3, 4), "instances' matrices"))
        for name in ("parts", "groups"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.uint16))
        count = len(self.matrices)
        if not count or not len(self.shape.faces) or self.groups.shape != (count,) or len(self.parts) != count:
            raise GeometryError("instances need a shape with faces, and places with a matrix, parts and a group each")
        if int(self.shape.face_part.max()) >= self.parts.shape[1]:
            raise GeometryError(f"instances list {self.parts.shape[1]} parts, fewer than their shape has")
        if not np.linalg.det(self.matrices[..., :3]).all():
            raise GeometryError("instances are scaled to nothing")

    @property
    def count(self) -> int:
        """The number of faces in all places."""
        return len(self.matrices) * len(self.shape.faces)

    @cached_property
    def key(self) -> str:
        """Digest of the inputs of labels."""
        return digest(self.shape.own_key, self.matrices, self.parts)

    @cached_property
    def shading_key(self) -> str:
        """Digest of the inputs of only the picture."""
        return digest(self.shape.own_shading_key, self.groups)

    @cached_property
    def mirrored(self) -> NDArray[np.bool_]:
        """(K,) where left and right are exchanged."""
        return frozen(np.linalg.det(self.matrices[..., :3]) < 0, bool)

    @cached_property
    def _normal_matrices(self) -> Float:
        """(K, 3, 4) normals turn by the inverse's transpose."""
        across = np.linalg.inv(self.matrices[..., :3]).swapaxes(1, 2)
        return frozen(np.concatenate([across, np.zeros((len(across), 3, 1))], axis=2))

    def moved(self, points: Float, place: int) -> Float:
        """`points` (N, 3) of the shape's axes in the body's, metres."""
        return affine(self.matrices[place], points)

    def area_vectors(self, vectors: Float) -> Float:
        """Return (K * N, 3) in body axes, in all places, of `vectors` (N, 3) in the shape's axes that stand across
        faces and are as long as their areas."""
        linear = self.matrices[..., :3]
        cofactors = np.linalg.det(linear)[:, None, None] * np.linalg.inv(linear).mT
        vectors_in_body: Float = vectors @ cofactors.mT
        return vectors_in_body.reshape(-1, 3)

    def faces(self, place: int) -> NDArray[np.int32]:
        """Return (F, 3) indices into the shape's points, counter-clockwise in this place."""
        return self.shape.faces[:, MIRRORED_CORNERS] if self.mirrored[place] else self.shape.faces

    def corners(self, place: NDArray[np.integer], face: NDArray[np.integer]) -> Float:
        """Return (N, 3, 3) body axes, metres, of the faces (N,) in their places (N,): to the bit as `moved` has
        them."""
        return self.in_place_order(place, affine(self.matrices[place, None], self.shape.points[self.shape.faces[face]]))

    def normals(self, place: NDArray[np.integer], face: NDArray[np.integer]) -> NDArray[np.float32]:
        """Return (N, 3, 3) unit shading normals at the corners, body axes."""
        normals = affine(self._normal_matrices[place, None], self.shape.corner_normals[face].astype(np.float64))
        return self.in_place_order(place, unit_vectors(normals)).astype(np.float32)

    def in_place_order(self, place: NDArray[np.integer], values: NDArray[Value]) -> NDArray[Value]:
        """`values` (N, 3, ...) at the corners of faces in their places (N,), in the order of the corners there."""
        if not self.mirrored.any():
            return values
        return np.where(self.mirrored[place][:, None, None], values[:, MIRRORED_CORNERS], values)
