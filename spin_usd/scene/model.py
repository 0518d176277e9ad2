"""One composed picture-taking situation: what both renderers draw and all labels describe.

Frozen and numpy only. `Scene.target` is the static part (the same object from frame to frame while the target
does not change shape); everything else is of one frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float, digest, finite, frozen
from spin_usd.errors import GeometryError
from spin_usd.geometry.blur import arc_height, circle_of_confusion, offset_reach
from spin_usd.geometry.bounds import region_of_interest
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.geometry.transform import Transform
from spin_usd.scene.content import content
from spin_usd.scene.environment import Environment
from spin_usd.scene.light import Light
from spin_usd.scene.material import Material
from spin_usd.scene.sensor import Optics, Sensor

MAX_FACES = 2**24  # a face's number travels through a renderer as a float32
MAX_PARTS = 2**16 - 1  # part ids are 16-bit in the segmentation label


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
    normals in body axes (the face's own normal where a face is flat) · face_group (F,) uint16 numbers that light links
    name, 0 unless given · primvars: (F, 3, C) float32 values at the corners, C 1 to 4, by name.
    Raises GeometryError for what a renderer must never see: NaN, indices out of range, no faces, too many.
    """

    points: Float
    faces: NDArray[np.int32]
    face_part: NDArray[np.uint16]
    face_material: NDArray[np.int32]
    corner_normals: NDArray[np.float32]
    face_group: NDArray[np.uint16] | None = None
    primvars: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.faces)
        if not 0 < count <= MAX_FACES:
            raise GeometryError(f"mesh has {count} faces, expected 1 to {MAX_FACES}")
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
        if self.faces.min() < 0 or self.faces.max() >= len(self.points):
            raise GeometryError(f"mesh faces index points outside 0 to {len(self.points) - 1}")
        if not np.isfinite(self.corner_normals).all():
            raise GeometryError("mesh corner normals hold NaN or infinity")
        primvars = {name: _primvar(name, values, count) for name, values in sorted(self.primvars.items())}
        object.__setattr__(self, "primvars", MappingProxyType(primvars))

    @cached_property
    def key(self) -> str:
        """Digest of the geometry and its parts: what labels depend on."""
        return digest(self.points, self.faces, self.face_part)

    @cached_property
    def shading_key(self) -> str:
        """Digest of what only the picture depends on."""
        primvars = [[name, digest(values)] for name, values in self.primvars.items()]
        return digest(self.face_material, self.corner_normals, self.face_group, primvars)

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

    @cached_property
    def cut_out_key(self) -> str:
        """Digest of what decides where the surface is not there: "" where it is whole."""
        if not any(material.cut_out for material in self.materials):
            return ""
        cuts = [[m.opacity, m.opacity_threshold] if m.cut_out else None for m in self.materials]
        return digest(content(cuts), self.mesh.shading_key)


@dataclass(frozen=True, kw_only=True)
class FrameId:
    """Which picture this is: `index` counts from 0, `name` is the image's stem, `time_code` is the stage's."""

    index: int
    name: str
    time_code: float


@dataclass(frozen=True, kw_only=True)
class ThinLens:
    """Depth of field: what lies `focus` metres (planar z) away is sharp. `radius`: the aperture's, metres."""

    radius: float
    focus: float

    def __post_init__(self) -> None:
        for name in ("radius", "focus"):
            if not 0 < getattr(self, name) < np.inf:
                raise GeometryError(f"thin lens {name} is {getattr(self, name)} m, expected above zero")


@dataclass(frozen=True, kw_only=True, eq=False)
class Shutter:
    """Motion blur. poses: T_cam_body at 3, 5, 9, 17, ... equally spaced times from the first row's opening to the last
    row's closing; the picture's own pose is the one in the middle. Between them the target's centre moves straight and
    its attitude turns steadily. `readout`: share of that time between the first row's opening and the last row's; 0 is
    a global shutter, 1 exposes each row for an instant. Only this motion is blurred: light, background, lens and the
    target's shape are those of the middle."""

    poses: tuple[Transform, ...]
    readout: float = 0.0

    def __post_init__(self) -> None:
        steps = len(self.poses) - 1
        if steps < 2 or steps & (steps - 1):
            raise GeometryError(
                f"shutter has {len(self.poses)} poses, expected 3, 5, 9 or another power of two, plus 1"
            )
        if not 0 <= self.readout <= 1:
            raise GeometryError(f"shutter readout is {self.readout}, expected a share from 0 to 1")

    @property
    def middle(self) -> Transform:
        return self.poses[len(self.poses) // 2]


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """Camera, target and its pose, lights, what lies behind, optics and sensor at one time code."""

    frame: FrameId
    camera: Camera
    T_cam_body: Transform
    target: Target
    lights: tuple[Light, ...]
    sensor: Sensor
    environment: Environment = field(default_factory=Environment)
    optics: Optics = field(default_factory=Optics)
    thin_lens: ThinLens | None = None
    shutter: Shutter | None = None

    def __post_init__(self) -> None:
        if self.shutter and self.shutter.middle.matrix.tobytes() != self.T_cam_body.matrix.tobytes():
            raise GeometryError("the scene's pose is not that of the shutter's middle")

    @cached_property
    def region(self) -> Region:
        """The pixels that the target can cover in the labels."""
        return region_of_interest(self.camera, self.T_cam_body.points(self.target.mesh.hull))

    @cached_property
    def picture_region(self) -> Region:
        """The pixels that the target can cover in the picture: those of `region`, and what its blur reaches."""
        if not (self.thin_lens or self.shutter):
            return self.region
        places = np.concatenate([pose.points(self.target.mesh.hull) for pose in self.poses])
        return region_of_interest(self.camera, places, reach=self.reach(places))

    @property
    def poses(self) -> tuple[Transform, ...]:
        """Where the target is while the shutter is open; its one pose where there is no motion."""
        return self.shutter.poses if self.shutter else (self.T_cam_body,)

    def reach(self, points_cam: Float) -> Float:
        """How far, in undistorted normalised coordinates, lens and motion smear the target's points (N, 3), camera
        frame, in its `poses`, beyond the straight lines from pose to pose."""
        reach = offset_reach(points_cam, self._arc_height)
        if self.thin_lens:
            reach += circle_of_confusion(points_cam[:, 2], radius=self.thin_lens.radius, focus=self.thin_lens.focus)
        return reach

    @cached_property
    def _arc_height(self) -> float:
        return arc_height(self.target.mesh.radius, self.poses)


def _primvar(name: str, values: NDArray[np.float32], faces: int) -> NDArray[np.float32]:
    array = frozen(values, np.float32)
    if array.ndim != 3 or array.shape[:2] != (faces, 3) or not 1 <= array.shape[2] <= 4:
        raise GeometryError(f"mesh primvar {name} has shape {array.shape}, expected ({faces}, 3, 1 to 4)")
    if not np.isfinite(array).all():
        raise GeometryError(f"mesh primvar {name} holds NaN or infinity")
    return array


def _hull_points(points: Float) -> Float:
    """Points that span the convex hull of `points` (N, 3); all of them when the hull is flat."""
    from scipy.spatial import ConvexHull, QhullError

    unique = np.unique(points, axis=0)
    try:
        return frozen(unique[ConvexHull(unique).vertices])
    except (QhullError, ValueError):
        return frozen(unique)
