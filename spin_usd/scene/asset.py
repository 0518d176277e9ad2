"""A model as a mesh file has it: named parts with polygons, in body axes, and materials with their image files."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, finite, frozen, shaped
from spin_usd.errors import GeometryError
from spin_usd.geometry.triangles import cross, parts
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.material import Material
from spin_usd.scene.texture import OUTPUTS, RGBA, WRAPS

SRGB, RAW = "sRGB", "raw"
AT_REST = "it has animations, and is shown in its stored rest state; --model-time 0 shows their beginning"
MAX_PARTS = 8192  # of a model: each becomes a prim with labels of its own, at some milliseconds


@dataclass(frozen=True, kw_only=True)
class ImageFile:
    """An image file of a model: its bytes, and its name; the suffix gives its format."""

    name: str
    data: bytes = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class ImageTransform:
    """UsdTransform2d: it scales st, then rotates it counter-clockwise by `rotation_deg`, then moves it."""

    scale: tuple[float, float] = (1.0, 1.0)
    rotation_deg: float = 0.0
    translation: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class ImageMap:
    """A UsdUVTexture by its file: `output` times `scale` plus `bias` (RGBA), placed by `placement`."""

    file: ImageFile
    color_space: str
    """SRGB or RAW, from which it is decoded."""
    output: str = "rgb"
    primvar: str = "st"
    """Name of the part's primvar with image coordinates for each corner."""
    placement: ImageTransform = ImageTransform()
    wrap: tuple[str, str] = ("repeat", "repeat")
    """Wrap modes of s and t."""
    scale: RGBA = (1.0, 1.0, 1.0, 1.0)
    bias: RGBA = (0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        valid = self.output in OUTPUTS and set(self.wrap) <= set(WRAPS) and self.color_space in (SRGB, RAW)
        if not valid:
            raise GeometryError(f"image {self.file.name} is used as {self.output}, {self.wrap}, {self.color_space}")


@dataclass(frozen=True, kw_only=True)
class ModelMaterial:
    """`constants` and primvars, and `images` for some inputs, by UsdPreviewSurface's own names; where an input has
    both, the image is shown."""

    constants: Material
    images: Mapping[str, ImageMap] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshPart:
    """Faces with all their data in a file.

    Raises GeometryError for points that are NaN, no faces, faces of fewer than 3 corners, indices out of range.
    """

    name: str
    points: Float
    """(P, 3) metres."""
    face_counts: NDArray[np.int32]
    """(F,) corners of each face, 3 or more."""
    face_indices: NDArray[np.int32]
    """(C,) points of the corners, face after face."""
    normals: Float | None
    """(C, 3) of the corners; None where the file has none."""
    face_material: NDArray[np.int32]
    """(F,) indices into the asset's materials, -1 for none."""
    primvars: Mapping[str, Float] = field(default_factory=dict)
    """Values of the corners: (C, 2) coordinates on images by the names that the images use, (C, 3) linear colours as
    displayColor."""
    groups: tuple[str, ...] = ()
    """Names of its groups in the file, such as the nodes above its own."""
    labels: Mapping[str, str] = field(default_factory=dict)
    """Semantic labels by taxonomy, beside its name."""
    copies: Float | None = None
    """(N, 4, 4) rotations, scales and translations of its copies in body axes, the first of which is the part itself;
    None for one alone."""

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
            object.__setattr__(self, "normals", shaped(self.normals, (corners, 3), f"normals of part {self.name!r}"))
        primvars = {
            name: shaped(values, (corners, None), f"{name} of part {self.name!r}")
            for name, values in self.primvars.items()
        }
        object.__setattr__(self, "primvars", primvars)

    @property
    def face_starts(self) -> NDArray[np.intp]:
        """(F,) index of each face's first corner."""
        return np.concatenate([[0], np.cumsum(self.face_counts[:-1], dtype=np.intp)])

    @cached_property
    def areas(self) -> tuple[Float, Float, Float]:
        """(F, 3) twice the area vector of each face; (F,) twice the area of the triangles around its first corner,
        more where it is concave or crosses itself; (F,) its longest edge."""
        vectors, sums, longest = (np.empty((len(self.face_counts), *shape)) for shape in ((3,), (), ()))
        starts = self.face_starts
        for faces in parts(len(sums)):
            own, counts = starts[faces] - starts[faces.start], self.face_counts[faces]
            corners = self.points[self.face_indices[starts[faces.start] : starts[faces.stop - 1] + counts[-1]]]
            following = np.arange(1, len(corners) + 1)
            following[own + counts - 1] = own
            first = np.repeat(corners[own], counts, axis=0)
            around = cross(corners - first, corners[following] - first)
            vectors[faces] = np.add.reduceat(around, own)
            sums[faces] = np.add.reduceat(np.linalg.norm(around, axis=1), own)
            longest[faces] = np.maximum.reduceat(np.linalg.norm(corners[following] - corners, axis=1), own)
        return vectors, sums, longest


@dataclass(frozen=True, kw_only=True, eq=False)
class Hinge:
    """The hinge by which a part is driven."""

    part: str
    """Name of the part."""
    axis: str
    """Axis of the body that it turns about: X, Y or Z."""
    at: Float
    """(3,) a point on that axis, metres."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshAsset:
    """A model from a mesh file, or a craft from a seed."""

    name: str
    parts: tuple[MeshPart, ...]
    materials: tuple[ModelMaterial, ...] = ()
    notes: tuple[str, ...] = ()
    """Notes for the user on how it was read."""
    metres_per_unit: float = 1.0
    """Length of the file's unit."""
    up: str = ""
    """The file's up axis; empty if not stated."""
    keypoints: Keypoints | None = None
    hinges: tuple[Hinge, ...] = ()
    symmetries: tuple[Float, ...] = ()
    """(4,) quaternions, scalar first, of the rotations that leave its shape and materials as they are."""

    def __post_init__(self) -> None:
        if not self.parts:
            raise GeometryError("the model has no faces")
        if len(self.parts) > MAX_PARTS:
            raise GeometryError(f"the model has {len(self.parts)} parts, more than {MAX_PARTS}; join some")

    @property
    def faces(self) -> int:
        """Return the number of faces, those of copies included."""
        return sum(len(part.face_counts) * (1 if part.copies is None else len(part.copies)) for part in self.parts)
