"""One composed scene: both renderers render it, and all labels describe it.

Frozen and numpy only. The bodies' `target` is the static part (the same object from frame to frame while the body
does not change shape); everything else is of one frame.
"""

from copy import copy
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import accumulate

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import GeometryError
from spin_usd.geometry.blur import arc_height, circle_of_confusion, offset_blur_radius
from spin_usd.geometry.bounds import beside, outline_of, polygon_area, region_around, region_of_interest
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region, union
from spin_usd.geometry.transform import Transform
from spin_usd.scene.body import Body
from spin_usd.scene.environment import Environment
from spin_usd.scene.lidar import Lidar, RangeFinder
from spin_usd.scene.light import Light
from spin_usd.scene.sensor import Optics, Sensor
from spin_usd.scene.target import Target

NOMINAL = "nominal"
STATED = ("source_file", "time_s", "utc")
"""Values that a stage may state of a picture without changing its files, by the fields of FrameId and of the record."""
"""The variant that is the stage without any augmentation."""


def variant_of(augmentation: str, camera: str) -> str:
    """Return the name of the variant that shows an augmentation as a further camera, or "" for the first, sees it."""
    return f"{augmentation}-{camera}" if camera else augmentation


def augmentation_and_camera(variant: str) -> tuple[str, str]:
    """Return the names that `variant_of` put together; neither has a "-"."""
    augmentation, _, camera = variant.partition("-")
    return augmentation, camera


@dataclass(frozen=True, kw_only=True)
class FrameId:
    """The identity of a picture."""

    index: int
    """Its place, from 0."""
    name: str
    """The image's stem."""
    time_code: float
    """The stage's."""
    variant: str = NOMINAL
    """Name from `variant_of`."""
    source_file: str = ""
    """The file that its pose was given for; "" for none."""
    time_s: float | None = None
    """Seconds since the start; None if unknown."""
    utc: str = ""
    """The same in ISO 8601; "" if the start is unknown."""

    @property
    def stated(self) -> dict[str, str | float]:
        """Values of STATED in the stage."""
        return {name: value for name in STATED if (value := getattr(self, name)) not in ("", None)}


@dataclass(frozen=True, kw_only=True)
class ThinLens:
    """Depth of field."""

    radius: float
    """The aperture's, metres."""
    focus: float
    """The planar z at which things are sharp, metres."""

    def __post_init__(self) -> None:
        for name in ("radius", "focus"):
            if not 0 < getattr(self, name) < np.inf:
                raise GeometryError(f"thin lens {name} is {getattr(self, name)} m, expected above zero")


@dataclass(frozen=True, kw_only=True)
class Shutter:
    """Motion blur by the bodies' poses, at equally spaced times from the first row's opening to the last row's closing.

    Between them a body's centre moves straight and its attitude turns at a constant rate. Only this motion is blurred:
    light, background, lens and the bodies' shapes are taken at the middle.
    """

    readout: float = 0.0
    """The share of that time between the first row's opening and the last row's; 0 is a global shutter, 1 exposes each
    row for an instant."""
    first_row: float = 0.0
    """Place of the picture's first row between the detector's, 0 to 1, if a row represents several."""
    last_row: float = 1.0
    """Where its last row lies, likewise."""

    def __post_init__(self) -> None:
        if not 0 <= self.readout <= 1:
            raise GeometryError(f"shutter readout is {self.readout}, expected a share from 0 to 1")


@dataclass(frozen=True, kw_only=True)
class Rig:
    """Which of a stage's several cameras takes a picture: its name, and how it stands to the first, in the axes of the
    first camera."""

    camera: str
    T_first_cam: Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """All that one picture shows, at one time code."""

    frame: FrameId
    camera: Camera
    bodies: tuple[Body, ...]
    """Targets in order of their ids, then occluders; at least one. For each body alone use `one_body_scenes`."""
    lights: tuple[Light, ...]
    sensor: Sensor
    environment: Environment = field(default_factory=Environment)
    optics: Optics = field(default_factory=Optics)
    thin_lens: ThinLens | None = None
    shutter: Shutter | None = None
    next_frame: "Scene | None" = None
    """The scene of the stage's next frame, if a label needs it."""
    paired: "Scene | None" = None
    """The same moment as another camera of the stage sees it, likewise: the second for the first, the first for all
    others."""
    rig: Rig | None = None
    """The camera of several; None if the stage has only one."""
    lidar: Lidar | None = None
    """None without a LiDAR."""
    range_finder: RangeFinder | None = None
    """None without a laser range finder."""
    classes: tuple[str, ...] = ()
    """The class names of all parts of the stage, by their ids in labels from 1; none where only the parts of these
    bodies are known."""

    def __post_init__(self) -> None:
        if not self.bodies:
            raise GeometryError("the scene has no body")
        counts = {len(body.poses) for body in self.bodies}
        if len(counts) > 1 or bool(self.shutter) != bool(max(counts)):
            raise GeometryError("the scene's bodies have not all one pose, or not as many poses as its shutter")

    @property
    def several(self) -> bool:
        """Whether there is more than one body."""
        return len(self.bodies) > 1

    @property
    def targets(self) -> tuple[Body, ...]:
        """The bodies that are targets, in order of their ids."""
        return tuple(body for body in self.bodies if body.is_target)

    @cached_property
    def part_offsets(self) -> tuple[int, ...]:
        """Number of parts of the bodies before each of `bodies`, including hidden ones: the offset of a body's part ids
        in labels."""
        counts = (len(body.target.parts) for body in self.bodies)
        shown = tuple(accumulate(counts, initial=0))[:-1]
        return tuple(
            before if body.part_offset is None else body.part_offset
            for body, before in zip(self.bodies, shown, strict=True)
        )

    @cached_property
    def one_body_scenes(self) -> "tuple[OneBody, ...]":
        """The same scene with each of `bodies` alone, of several as target 1."""
        bodies = [replace(body, id=1, part_offset=None) for body in self.bodies] if self.several else self.bodies
        rest = {each.name: getattr(self, each.name) for each in fields(self) if each.name != "bodies"}
        return tuple(OneBody(bodies=(body,), **rest) for body in bodies)

    @cached_property
    def region(self) -> Region:
        """The pixels that a body can cover in the labels."""
        return union(one.region for one in self.one_body_scenes) if self.several else self.one_body_scenes[0].region

    @cached_property
    def picture_region(self) -> Region:
        """The pixels that a body can cover in the picture: `region`, and the pixels of its blur."""
        return (
            union(one.picture_region for one in self.one_body_scenes)
            if self.several
            else self.one_body_scenes[0].picture_region
        )

    @cached_property
    def outline_pixels(self) -> float:
        """The area, pixels, of the outlines of the bodies' convex hulls in the picture: an upper bound of their
        coverage."""
        region = self.picture_region
        return min(sum(one.outline_pixels for one in self.one_body_scenes), float(region.width * region.height))

    @cached_property
    def outline_box(self) -> Float | None:
        """(2, 2): the least and the greatest pixel of the bodies' outlines in the picture; None if there are none, or
        if they could be anywhere."""
        boxes = [one.outline_box for one in self.one_body_scenes if not one.picture_region.empty]
        known = [box for box in boxes if box is not None]
        if not boxes or len(known) < len(boxes):
            return None
        return np.array([np.min(known, axis=0)[0], np.max(known, axis=0)[1]])

    def with_lights(self, lights: tuple[Light, ...]) -> "Scene":
        """Return the same scene with other lights, keeping results computed from its geometry."""
        other = copy(self)
        object.__setattr__(other, "lights", lights)
        return other

    @property
    def blurred(self) -> bool:
        """True where lens or motion blur the bodies."""
        return bool(self.thin_lens or self.shutter)


@dataclass(frozen=True, kw_only=True, eq=False)
class OneBody(Scene):
    """A scene of exactly one body, target or occluder."""

    def __post_init__(self) -> None:
        super().__post_init__()
        assert not self.several

    @property
    def target(self) -> Target:
        """The body itself."""
        return self.bodies[0].target

    @property
    def T_cam_body(self) -> Transform:
        """Where the body is."""
        return self.bodies[0].T_cam_body

    @property
    def poses(self) -> tuple[Transform, ...]:
        """The body's poses while the shutter is open; its one pose without motion."""
        return self.bodies[0].poses or (self.T_cam_body,)

    @property
    def one_body_scenes(self) -> "tuple[OneBody, ...]":
        """This scene."""
        return (self,)

    @cached_property
    def region(self) -> Region:
        """As in a scene of several."""
        if not self.blurred:
            return self.picture_region
        return region_of_interest(self.camera, self.T_cam_body.points(self.target.mesh.hull))

    @cached_property
    def picture_region(self) -> Region:
        """As in a scene of several."""
        outline = self._picture_outline
        return self.camera.frame if outline is None else region_around(self.camera, outline)

    @cached_property
    def outline_pixels(self) -> float:
        """As in a scene of several."""
        region, outline = self.picture_region, self._picture_outline
        box = float(region.width * region.height)
        return box if outline is None else min(polygon_area(outline), box)

    @cached_property
    def outline_box(self) -> Float | None:
        """As in a scene of several."""
        outline = self._picture_outline
        return None if outline is None or not len(outline) else np.array([outline.min(0), outline.max(0)])

    @cached_property
    def _picture_outline(self) -> Float | None:
        places = np.concatenate([pose.points(self.target.mesh.hull) for pose in self.poses])
        if self.shutter and not self.thin_lens and beside(self.camera, places, self._arc_height):
            return np.zeros((0, 2))
        return outline_of(self.camera, places, blur_radius=self.blur_radius(places) if self.blurred else None)

    def blur_radius(self, points_cam: Float) -> Float:
        """Return the radii (N,), in undistorted normalised coordinates, by which lens and motion blur the body's points
        (N, 3), camera frame, in its `poses`, beyond the straight lines from pose to pose."""
        radius = offset_blur_radius(points_cam, self._arc_height)
        if self.thin_lens:
            radius += circle_of_confusion(points_cam[:, 2], radius=self.thin_lens.radius, focus=self.thin_lens.focus)
        return radius

    @cached_property
    def _arc_height(self) -> float:
        return arc_height(self.target.mesh.radius, self.poses)
