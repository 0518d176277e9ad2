"""One composed picture-taking situation: what both renderers draw and all labels describe.

Frozen and numpy only. `Scene.target` is the static part (the same object from frame to frame while the target
does not change shape); everything else is of one frame.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float, digest, finite, frozen
from spin_usd.errors import GeometryError
from spin_usd.geometry.bounds import region_of_interest
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.geometry.transform import Transform

MAX_FACES = 2**24  # a face's number travels through a renderer as a float32
MAX_PARTS = 2**16 - 1  # part ids are 16-bit in the segmentation label

Color = tuple[float, float, float]
"""Linear RGB with Rec. 709 primaries."""


@dataclass(frozen=True, kw_only=True)
class Material:
    """The constants of UsdPreviewSurface, by its own names; colours linear Rec. 709."""

    path: str
    diffuse_color: Color = (0.18, 0.18, 0.18)
    emissive_color: Color = (0.0, 0.0, 0.0)
    use_specular_workflow: bool = False
    specular_color: Color = (0.0, 0.0, 0.0)
    metallic: float = 0.0
    roughness: float = 0.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.01
    opacity: float = 1.0
    ior: float = 1.5

    @cached_property
    def key(self) -> str:
        return digest([list(v) if isinstance(v, tuple) else v for k, v in sorted(vars(self).items()) if k != "path"])


@dataclass(frozen=True, kw_only=True)
class Part:
    """A piece of the target that the segmentation label tells apart. `id` counts from 1 in order of prim path."""

    id: int
    path: str
    name: str
    class_name: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh:
    """Triangles of the whole target in body axes.

    points (P, 3) float64 metres · faces (F, 3) int32, counter-clockwise seen from outside · face_part (F,) uint16
    part ids · face_material (F,) int32 indices into Target.materials · corner_normals (F, 3, 3) float32 unit shading
    normals in body axes (the face's own normal where a face is flat).
    Raises GeometryError for what a renderer must never see: NaN, indices out of range, no faces, too many.
    """

    points: Float
    faces: NDArray[np.int32]
    face_part: NDArray[np.uint16]
    face_material: NDArray[np.int32]
    corner_normals: NDArray[np.float32]

    def __post_init__(self) -> None:
        count = len(self.faces)
        if not 0 < count <= MAX_FACES:
            raise GeometryError(f"mesh has {count} faces, expected 1 to {MAX_FACES}")
        object.__setattr__(self, "points", finite(self.points, (None, 3), "mesh points"))
        kinds = {
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
        if self.faces.min() < 0 or self.faces.max() >= len(self.points):
            raise GeometryError(f"mesh faces index points outside 0 to {len(self.points) - 1}")
        if not np.isfinite(self.corner_normals).all():
            raise GeometryError("mesh corner normals hold NaN or infinity")

    @cached_property
    def key(self) -> str:
        """Digest of the geometry and its parts: what labels depend on."""
        return digest(self.points, self.faces, self.face_part)

    @cached_property
    def shading_key(self) -> str:
        """Digest of what only the picture depends on."""
        return digest(self.face_material, self.corner_normals)

    @cached_property
    def edges(self) -> NDArray[np.int32]:
        """(E, 2) each edge once, as indices into points."""
        pairs = np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        edges: NDArray[np.int32] = np.unique(np.sort(pairs, axis=1), axis=0)
        return edges

    @cached_property
    def centre(self) -> Float:
        """(3,) middle of the bounding box, body axes, metres."""
        used = self.points[np.unique(self.faces)]
        return (used.min(0) + used.max(0)) / 2

    @cached_property
    def radius(self) -> float:
        """Largest distance of a used point from `centre`, metres."""
        return float(np.linalg.norm(self.points[np.unique(self.faces)] - self.centre, axis=1).max())

    @cached_property
    def hull(self) -> Float:
        """(N, 3) points whose convex hull is the mesh's: few, so that bounding it every frame costs nothing."""
        return _hull_points(self.points[np.unique(self.faces)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Target:
    """The spacecraft: mesh, parts, materials, named keypoints (K, 3) in body axes, metres."""

    path: str
    name: str
    mesh: Mesh
    parts: tuple[Part, ...]
    materials: tuple[Material, ...]
    keypoint_names: tuple[str, ...] = ()
    keypoints: Float = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        if [p.id for p in self.parts] != list(range(1, len(self.parts) + 1)) or len(self.parts) > MAX_PARTS:
            raise GeometryError(f"{self.path} has parts that are not numbered 1 to at most {MAX_PARTS}")
        if int(self.mesh.face_part.max()) > len(self.parts) or int(self.mesh.face_part.min()) < 1:
            raise GeometryError(f"{self.path} has faces of a part that it does not list")
        if int(self.mesh.face_material.max()) >= len(self.materials) or int(self.mesh.face_material.min()) < 0:
            raise GeometryError(f"{self.path} has faces of a material that it does not list")
        object.__setattr__(self, "keypoints", finite(self.keypoints, (len(self.keypoint_names), 3), "keypoints"))


@dataclass(frozen=True, kw_only=True)
class DistantLight:
    """A Sun. `direction_cam` (unit, camera axes) is where its light travels *to*; `irradiance` is linear RGB in W/m2
    on a plane that faces it; `angle` is its angular diameter in radians."""

    path: str
    direction_cam: tuple[float, float, float]
    irradiance: Color
    angle: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """How linear radiance becomes numbers. `exposure` scales radiance (W/m2/sr) to the unit range; `channels` is "mono"
    or "rgb"; `bit_depth` 8 or 16; `encoding` "linear" or "srgb"."""

    exposure: float = 1.0
    channels: str = "mono"
    bit_depth: int = 8
    encoding: str = "srgb"


@dataclass(frozen=True, kw_only=True)
class FrameId:
    """Which picture this is: `index` counts from 0, `name` is the image's stem, `time_code` is the stage's."""

    index: int
    name: str
    time_code: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """Camera, target and its pose, lights and sensor at one time code."""

    frame: FrameId
    camera: Camera
    T_cam_body: Transform
    target: Target
    lights: tuple[DistantLight, ...]
    sensor: Sensor

    @cached_property
    def region(self) -> Region:
        """The pixels that the target can cover."""
        return region_of_interest(self.camera, self.T_cam_body.points(self.target.mesh.hull))


def _hull_points(points: Float) -> Float:
    """Points that span the convex hull of `points` (N, 3); all of them when the hull is flat."""
    from scipy.spatial import ConvexHull, QhullError

    unique = np.unique(points, axis=0)
    try:
        return frozen(unique[ConvexHull(unique).vertices])
    except (QhullError, ValueError):
        return frozen(unique)
