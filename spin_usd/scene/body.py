"""A body: something that moves as one, with its shape and where it is."""

from dataclasses import dataclass, field, replace

from spin_usd.basics.arrays import Float, digest, finite
from spin_usd.errors import GeometryError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.content import NAME
from spin_usd.scene.target import Target

OCCLUDER = 0  # the id of all other geometry, and of no surface, in the label `instance`


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyMotion:
    """How a body moves before the camera, in the camera's axes."""

    velocity: Float
    """(3,) velocity of the origin of its axes, m/s."""
    angular_velocity: Float
    """(3,) radians a second."""

    def __post_init__(self) -> None:
        for name in ("velocity", "angular_velocity"):
            object.__setattr__(self, name, finite(getattr(self, name), (3,), name))

    @property
    def key(self) -> str:
        """The digest of both."""
        return digest(self.velocity, self.angular_velocity)


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A target, or an occluder: geometry that only occludes, shades and reflects."""

    id: int
    """Number of a target, from 1 in the stage's order; 0 for an occluder."""
    target: Target
    """Its shape, parts and materials, also for an occluder."""
    T_cam_body: Transform
    """Its pose, in the middle of the exposure."""
    poses: tuple[Transform, ...] = ()
    """T_cam_body at 3, 5, 9, 17, ... equally spaced times while the shutter is open; none where nothing is blurred."""
    part_offset: int | None = None
    """Offset from the numbers of its own parts to their ids in labels. None stands for the number of parts of the
    bodies before it in the scene."""
    motion: BodyMotion | None = field(default=None, metadata=NAME)
    """None if not in the stage."""

    def __post_init__(self) -> None:
        if self.id < OCCLUDER:
            raise GeometryError(f"{self.target.path} is the target {self.id}, expected 1 or more, or 0 of an occluder")
        steps = len(self.poses) - 1
        if self.poses and (steps < 2 or steps & (steps - 1)):
            raise GeometryError(
                f"{self.target.path} has {len(self.poses)} poses, expected 3, 5, 9 or another power of two, plus 1"
            )
        if self.poses and self.poses[steps // 2].matrix.tobytes() != self.T_cam_body.matrix.tobytes():
            raise GeometryError(f"the pose of {self.target.path} is not the shutter's middle")

    @property
    def is_target(self) -> bool:
        return self.id != OCCLUDER

    @property
    def still(self) -> "Body":
        """The same body at rest in its pose."""
        return replace(self, poses=()) if self.poses else self
