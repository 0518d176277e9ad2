"""The tables of a sampling specification, as written, each with its law.

schemas/sample-1.schema.json is generated from these types.
"""

from collections.abc import Mapping
from math import inf, radians
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from spin_usd.basics.json_fields import Positive, Share
from spin_usd.errors import InputError
from spin_usd.sampling.distribution import Uniform, Vector
from spin_usd.sampling.poses import Inside, OffsetLaw, PlaceLaw, PoseLaw, PositionLaw, ShareLaw
from spin_usd.sampling.relative_motion import Approach, FreeFall, RelativeOrbit
from spin_usd.sampling.sample import AnyDistribution
from spin_usd.sampling.trajectory import Chaser, TrajectoryLaw, Transfer
from spin_usd.sampling.turning import Spin, Tumble

ANYWHERE = Uniform(low=0, high=1)
Frame = tuple[int, int]
"""Width and height, pixels, of the pictures that offsets refer to."""

Pair = tuple[float, float]
Count = Annotated[int, Meta(ge=1, le=1_000_000)]
# A tuple of two types would do too, but msgspec 0.22 crashes on one beside a number with bounds.
Shares = Annotated[tuple[Share, ...], Meta(min_length=2, max_length=2)]
Inclusion = Annotated[
    Share | Shares,
    Meta(
        description="How much of the target's outline is in the picture, 1 being all: the least share, or the least "
        "and the greatest."
    ),
]
ABOVE_0 = {"exclusiveMinimum": 0}
NUMBERS_ABOVE_0: dict[str, Any] = {
    "properties": {"value": ABOVE_0, "low": ABOVE_0, "values": {"items": ABOVE_0}},
    "if": {"properties": {"distribution": {"const": "normal"}}, "required": ["distribution"]},
    "then": {"required": ["low"]},
}
Away = Annotated[
    AnyDistribution,
    Meta(
        description="From the camera to the target's origin, metres: a distribution of numbers above 0.",
        extra_json_schema=NUMBERS_ABOVE_0,
    ),
]
Diameters = Annotated[
    AnyDistribution,
    Meta(
        description="The same in diameters of the ball around the target, for targets of many sizes.",
        extra_json_schema=NUMBERS_ABOVE_0,
    ),
]


class SpecTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of a specification."""


class Place(SpecTable, frozen=True, kw_only=True):
    """The place of the target's origin in the picture."""

    across: Annotated[
        AnyDistribution | None,
        Meta(
            description="Its offset to the right of the principal point, pixels, as a lens without distortion shows it."
        ),
    ] = None
    down: Annotated[
        AnyDistribution | None, Meta(description="Its offset below the principal point, pixels; goes with across.")
    ] = None
    u_share: Annotated[
        AnyDistribution | None,
        Meta(
            description="Where its origin is in the picture, as the lens shows it: from the left edge, of the width; "
            "anywhere, if not given."
        ),
    ] = None
    v_share: Annotated[AnyDistribution | None, Meta(description="From the top, of the height.")] = None

    def place(self, frame: Frame | None, where: str) -> PlaceLaw:
        """Return the law of the place in the picture. Raises InputError with `where`."""
        if self.across is None and self.down is None:
            return ShareLaw(u=self.u_share or ANYWHERE, v=self.v_share or ANYWHERE)
        if self.across is None or self.down is None:
            raise InputError("gives only one of across and down", where=where, do="give both")
        if self.u_share or self.v_share:
            found = "gives a place both in pixels (across) and in shares (u_share, v_share)"
            raise InputError(found, where=where, do="give one of the two")
        if frame is None:
            do = "name the camera whose pixels these are, or give u_share and v_share"
            raise InputError("gives across and down, and no camera", where=where, do=do)
        return OffsetLaw(across=self.across, down=self.down, frame=frame)


class Position(Place, frozen=True, kw_only=True):
    """The place of the target's origin."""

    range: Away

    def law(self, frame: Frame | None, where: str) -> PositionLaw:
        """Return the law of the position. Raises InputError with `where`."""
        return PositionLaw(range=self.range, place=self.place(frame, where))


class Poses(Place, frozen=True, kw_only=True):
    """Pictures independent of one another; with one of range and range_diameters."""

    range: Away | None = None
    range_diameters: Diameters | None = None
    attitude: Annotated[AnyDistribution, Meta(description="The rotation from body to camera, w, x, y, z.")]
    inside: Inclusion | None = None

    def pose_law(self, frame: Frame | None, where: str) -> PoseLaw:
        """Return the law of the poses. Raises InputError with `where`."""
        distance = only({"range": self.range, "range_diameters": self.range_diameters})
        position = PositionLaw(range=distance, in_diameters=self.range is None, place=self.place(frame, where))
        return PoseLaw(position=position, attitude=self.attitude, inside=inside_law(self.inside, where))


class BodyPoses(Place, frozen=True, kw_only=True):
    """The placement of a further body; missing values are taken from the target's law."""

    range: AnyDistribution | None = None
    range_diameters: AnyDistribution | None = None
    distance: AnyDistribution | None = None
    attitude: AnyDistribution | None = None
    inside: Inclusion | None = None


class ChaserTable(SpecTable, frozen=True, kw_only=True):
    """The place of the camera's craft, in the axes of the target's orbit: up, forward, normal. Its camera points at the
    target."""

    orbit: RelativeOrbit | None = None
    free_fall: FreeFall | None = None
    approach: Approach | None = None

    def __post_init__(self) -> None:
        self.law()

    def law(self) -> Chaser:
        """Return the one motion that is given. Raises InputError."""
        return Chaser(motion=only({name: getattr(self, name) for name in self.__struct_fields__}))


class Trajectory(SpecTable, frozen=True, kw_only=True):
    """Sequences of pictures of a target and a camera in relative motion: given by one of orbit, chaser, or start and
    end; with one of spin and tumble."""

    step: Annotated[Positive, Meta(description="Seconds between pictures.")] = field(name="step_s")
    period: Annotated[Positive, Meta(description="Period of the orbit; without it motion is straight.")] = field(
        name="period_s", default=inf
    )
    tilt_deg: Annotated[Pair, Meta(description="The camera's turn about its x and y.")] = (0.0, 0.0)
    centre_of_mass: Annotated[Vector, Meta(description="Point that the target turns about, body frame.")] = field(
        name="centre_of_mass_m", default=(0.0, 0.0, 0.0)
    )
    range: Annotated[Pair, Meta(description="Distances that the target stays within.")] = field(
        name="range_m", default=(0.0, inf)
    )
    attitude: Annotated[AnyDistribution, Meta(description="The rotation from body to camera at the start.")]
    spin: Spin | None = None
    tumble: Tumble | None = None
    orbit: Annotated[
        RelativeOrbit | None,
        Meta(description="Orbit of the target relative to the camera's craft, which looks along its flight."),
    ] = None
    start: Position | None = None
    end: Position | None = None
    chaser: ChaserTable | None = None
    inside: Inclusion | None = None
    sun: Annotated[
        AnyDistribution | None,
        Meta(
            description="To the Sun at the start, orbit's axes: up, forward, normal. It stays among the stars; without "
            "it, light moves with the camera."
        ),
    ] = None

    def __post_init__(self) -> None:
        only({"spin": self.spin, "tumble": self.tumble})
        only({"orbit": self.orbit, "start and end": self.start and self.end, "chaser": self.chaser})

    def law(self, frame: Frame | None, where: str) -> TrajectoryLaw:
        """Return the law of the trajectory. Raises InputError with `where`."""
        pitch, yaw = self.tilt_deg
        return TrajectoryLaw(
            path=self._path(frame, where),
            spin=only({"spin": self.spin, "tumble": self.tumble}),
            attitude=self.attitude,
            step=self.step,
            period=self.period,
            tilt=(radians(pitch), radians(yaw)),
            centre_of_mass=self.centre_of_mass,
            range=self.range,
            inside=inside_law(self.inside, where),
            sun=self.sun,
        )

    def _path(self, frame: Frame | None, where: str) -> RelativeOrbit | Transfer | Chaser:
        if self.start and self.end:
            return Transfer(start=self.start.law(frame, f"{where}, start"), end=self.end.law(frame, f"{where}, end"))
        return self.chaser.law() if self.chaser else only({"orbit": self.orbit})


class Published(SpecTable, frozen=True, kw_only=True):
    """The set's own statistics, to compare with; unknown ones are absent."""

    count: Count | None = None
    sequences: Count | None = None
    range_m: Annotated[Pair | None, Meta(description="Least and most.")] = None
    range_mean_m: float | None = None
    attitude_squares: Annotated[
        tuple[float, float, float, float] | None, Meta(description="Means of the squares of w, x, y, z.")
    ] = None
    centre_px: Annotated[Pair | None, Meta(description="Standard deviations of the offsets across and down.")] = None
    centre_most_px: Annotated[Pair | None, Meta(description="Largest offsets across and down.")] = None
    degrees: Annotated[
        Annotated[tuple[float, ...], Meta(min_length=1, max_length=2)] | None,
        Meta(description="From picture to picture."),
    ] = None
    step_mm: Annotated[Pair | None, Meta(description="The origin's way from picture to picture: least and most.")] = (
        None
    )
    earth_share: Annotated[Share | None, Meta(description="Pictures with the Earth.")] = None
    source: str | None = None


class PartTable(SpecTable, frozen=True, kw_only=True):
    """A part of the pictures, with either poses or a trajectory."""

    name: Annotated[str, Meta(pattern="^[a-z0-9_]+$", description="Name of the part; unique.")]
    names: Annotated[
        str,
        Meta(
            pattern=r"^([A-Za-z0-9._-]|\{(sequence|picture)(:0[1-9]d)?\})+$",
            description="Of pictures, from {sequence} and {picture}, with digits such as {picture:06d}.",
        ),
    ]
    sequences: Annotated[Count, Meta(description="Number of sequences.")] = 1
    pictures: Annotated[Count, Meta(description="Number of pictures in each sequence.")]
    first_sequence: Annotated[int, Meta(ge=0, description="Number of the first sequence in names.")] = 1
    first_picture: Annotated[int, Meta(ge=0, description="Number of the first picture in names.")] = 1
    poses: Poses | None = None
    trajectory: Trajectory | None = None
    sample: dict[str, Any] = {}
    published: Published | None = None

    def __post_init__(self) -> None:
        only({"poses": self.poses, "trajectory": self.trajectory})

    def law(self, frame: Frame | None, where: str) -> PoseLaw | TrajectoryLaw:
        """Return the law of its pictures. Raises InputError with `where`."""
        if self.poses:
            return self.poses.pose_law(frame, where)
        law: TrajectoryLaw = only({"trajectory": self.trajectory}).law(frame, where)
        return law


class SamplingTables(SpecTable, frozen=True, kw_only=True):
    """Pictures to sample: poses and light, for spin-usd author --sample."""

    schema: Literal["sample-1"]
    title: Annotated[str, Meta(description="Description for people; for a published data set its name.")] = ""
    camera: Annotated[
        str | None,
        Meta(description="A built-in camera's name; --camera replaces it, and is needed if this is absent."),
    ] = None
    target: Annotated[
        str | None,
        Meta(description="A built-in target's name; --target replaces it, and is needed if this is absent."),
    ] = None
    preset: Annotated[
        str | None,
        Meta(description="How pictures are taken: a built-in preset's name, or a preset layer's beside this file."),
    ] = None
    lights: Annotated[str | None, Meta(description="Built-in lights' name.")] = None
    environment: Annotated[str | None, Meta(description="A built-in environment's name.")] = None
    notes: Annotated[tuple[str, ...], Meta(description="Missing features of the likeness, and assumptions.")] = ()
    sample: dict[str, Any] = {}
    constraints: dict[str, float] = {}
    part: Annotated[
        tuple[PartTable, ...], Meta(min_length=1, description="The set's parts, in the order of their pictures.")
    ]
    published: Published | None = None


def inside_law(given: Inclusion | None, where: str) -> Inside | None:
    """Return the required share in the picture. Raises InputError with `where`."""
    if given is None:
        return None
    least, most = given if isinstance(given, tuple) else (given, 1.0)
    if least > most:
        raise InputError(f"inside is from {least:g} to {most:g}", where=where, do="give the lower share first")
    return Inside(least=least, most=most)


def only(given: Mapping[str, Any]) -> Any:
    """Return the one table that is given. Raises InputError for none and for several."""
    found = [name for name, each in given.items() if each]
    if not found:
        raise InputError(f"has none of {', '.join(given)}", do="add one of them")
    if len(found) > 1:
        raise InputError(f"has both {' and '.join(found)}", do="keep one of them")
    return given[found[0]]
