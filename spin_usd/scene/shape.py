"""Triangles in their own axes, with their data for the picture."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, digest, finite, frozen
from spin_usd.errors import GeometryError
from spin_usd.geometry.triangles import parts, unit_normals

MAX_FACES = 2**24  # a face's number travels through a renderer as a float32
MIN_SHARED_FACES = 1000
"""Least faces of a shape that copies share: a copy costs a renderer more than fewer faces."""
FLAT = 1e-3  # corner normals this near the face's own are a flat face's


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape:
    """Triangles in their own axes.

    Raises GeometryError for values that a renderer must never get: NaN, indices out of range, too many faces.
    """

    points: Float
    """(P, 3) metres."""
    faces: NDArray[np.int32]
    """(F, 3), counter-clockwise seen from outside."""
    face_part: NDArray[np.uint16]
    """(F,) part ids."""
    face_material: NDArray[np.int32]
    """(F,) indices into Target.materials."""
    corner_normals: NDArray[np.float32]
    """(F, 3, 3) unit shading normals; the face's own normal where a face is flat."""
    face_group: NDArray[np.uint16] | None = None
    """(F,) numbers that light links name, 0 unless given."""
    primvars: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    """(F, 3, C) values at the corners, C 1 to 4, by name."""

    def __post_init__(self) -> None:
        count = len(self.faces)
        if count > MAX_FACES:
            raise GeometryError(f"mesh has {count} faces, expected at most {MAX_FACES}")
        object.__setattr__(self, "points", finite(self.points, (None, 3), "mesh points"))
        if self.face_group is None:
            object.__setattr__(self, "face_group", np.zeros(count, np.uint16))
        kinds = {
            "face_group": (np.uint16, (count,)),
            "faces": (np.int32, (count, 3)),
            "face_part": (np.uint16, (count,)),
            "face_material": (np.int32, (count,)),
            "corner_normals": (np.float32, (count, 3, 3)),
        }
        for name, (kind, shape) in kinds.items():
            array = frozen(getattr(self, name), kind)
            if array.shape != shape:
                raise GeometryError(f"mesh {name} has shape {array.shape}, expected {shape}")
            object.__setattr__(self, name, array)
        if self.faces.min(initial=0) < 0 or self.faces.max(initial=-1) >= len(self.points):
            raise GeometryError(f"mesh faces index points outside 0 to {len(self.points) - 1}")
        if not np.isfinite(self.corner_normals).all():
            raise GeometryError("mesh corner normals hold NaN or infinity")
        primvars = {name: _primvar(name, values, count) for name, values in sorted(self.primvars.items())}
        object.__setattr__(self, "primvars", MappingProxyType(primvars))

    @cached_property
    def own_key(self) -> str:
        """Digest of the geometry and its parts, the inputs of labels."""
        return digest(self.points, self.faces, self.face_part)

    @cached_property
    def own_shading_key(self) -> str:
        """Digest of the inputs of only the picture."""
        primvars = [[name, digest(values)] for name, values in self.primvars.items()]
        return digest(self.face_material, self.corner_normals, self.face_group, primvars)

    @cached_property
    def edges(self) -> NDArray[np.int32]:
        """(E, 2) each edge once, as indices into points, in their order."""
        ends = np.sort(self.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
        pairs = np.sort(ends[:, 0] * len(self.points) + ends[:, 1])  # as one number a pair: ten times faster
        once = pairs[np.flatnonzero(np.diff(pairs, prepend=-1))]
        return np.stack(np.divmod(once, max(len(self.points), 1)), -1).astype(np.int32)

    @property
    def used_points(self) -> Float:
        """(N, 3) the points that faces have, in their order."""
        used = np.zeros(len(self.points), bool)
        used[self.faces] = True
        points: Float = self.points[used]
        return points

    @cached_property
    def smooth(self) -> NDArray[np.bool_]:
        """(F,) whether a face's corner normals differ from its own normal."""
        found = np.empty(len(self.faces), bool)
        for some in parts(len(found)):
            normal = unit_normals(self.points[self.faces[some]])
            found[some] = np.abs(self.corner_normals[some] - normal[:, None]).max((1, 2), initial=0) > FLAT
        return frozen(found, bool)

    @cached_property
    def own_hull(self) -> Float:
        """(N, 3) points with the same convex hull as these triangles."""
        return hull_points(self.used_points)


def hull_points(points: Float) -> Float:
    """Points that span the convex hull of `points` (N, 3); all of them when the hull is flat."""
    ordered = points[np.lexsort(points.T[::-1])]  # np.unique along an axis does the same in twice the time
    unique = ordered[np.r_[True, (ordered[1:] != ordered[:-1]).any(1)]] if len(ordered) else ordered
    return frozen(spanning(unique))


def spanning(points: Float) -> Float:
    """Return those of the `points` (N, 3) that span their convex hull; all of them when the hull is flat."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):
        return points


def _primvar(name: str, values: NDArray[np.float32], faces: int) -> NDArray[np.float32]:
    array = frozen(values, np.float32)
    if array.ndim != 3 or array.shape[:2] != (faces, 3) or not 1 <= array.shape[2] <= 4:
        raise GeometryError(f"mesh primvar {name} has shape {array.shape}, expected ({faces}, 3, 1 to 4)")
    if not np.isfinite(array).all():
        raise GeometryError(f"mesh primvar {name} holds NaN or infinity")
    return array
