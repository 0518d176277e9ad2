"""The kinds of attitude in a scenario: each gives the rotations of a craft's axes at the scenario's epochs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from msgspec import field as named

from spin_usd.basics.arrays import Float
from spin_usd.basics.json_fields import one_of
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_POSE_LIST
from spin_usd.formats.ccsds_file import EphemerisSegment, read_aem
from spin_usd.formats.text_file import lines_of
from spin_usd.geometry.rotation import QUATERNION_NORM_ROUNDED, matrices_from_quaternions
from spin_usd.orbits.epochs import Epochs, frame_named
from spin_usd.orbits.orbit_context import OrbitContext
from spin_usd.orbits.pieces import At, Piece, ordered, pieced, useable_span
from spin_usd.orbits.propagation import rtn_axes
from spin_usd.sampling.distribution import Vector
from spin_usd.sampling.turning import Inertia, tensor_of, tumbled

Unit = tuple[float, float, float, float]
FASTEST, MOST_TURNS = 3600.0, 5000  # degrees a second; 5,000 turns are integrated in 3 s
CLOSE_TURN = 1e-4  # radians, by which two segments of a file may differ without a note
ALONG = 1e-6  # the sine of the least angle between two directions that fix an attitude


@dataclass(frozen=True, kw_only=True, eq=False)
class Sight:
    """Input of an attitude: states (N, 6) of the craft itself and of the other one."""

    context: OrbitContext
    own: Float
    other: Float


DIRECTIONS: dict[str, Callable[[Sight], Float]] = {
    "target": lambda sight: sight.other[:, :3] - sight.own[:, :3],
    "nadir": lambda sight: -sight.own[:, :3],
    "zenith": lambda sight: sight.own[:, :3],
    "velocity": lambda sight: sight.own[:, 3:],
    "orbit_normal": lambda sight: rtn_axes(sight.own)[:, :, 2],
    "sun": lambda sight: sight.context.epochs.sun - sight.own[:, :3],
    "moon": lambda sight: sight.context.epochs.moon - sight.own[:, :3],
}
DIRECTIONS["chaser"] = DIRECTIONS["target"]
"""Directions in GCRF by the name of the object pointed at; target and chaser both mean the other craft."""
Where = Annotated[str, one_of(*DIRECTIONS)] | Vector


class _Attitude(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An attitude in a scenario. `rotations` returns the rotations (N, 3, 3) from the craft's axes to GCRF, and raises
    InputError. files: the names of its files."""

    @property
    def files(self) -> tuple[str, ...]:
        return ()


class AttitudeFile(_Attitude, frozen=True, kw_only=True):
    """An attitude in a file."""

    file: Annotated[str, Meta(description="Beside the scenario.")]

    @property
    def files(self) -> tuple[str, ...]:
        return (self.file,)


class Aem(AttitudeFile, frozen=True, kw_only=True, tag_field="kind", tag="aem"):
    """A CCSDS attitude ephemeris of quaternions, KVN or XML."""

    craft: Annotated[str | None, Meta(description="Craft in a file of several, by its name or id.")] = named(
        name="object", default=None
    )

    def rotations(self, sight: Sight) -> Float:
        context, epochs = sight.context, sight.context.epochs
        path = context.path(self.file)

        def between(segment: EphemerisSegment) -> Piece:
            times = ordered(epochs.seconds_of(segment.times, segment.time_system, path), path)
            turns = _smooth(context, times, frame_named(segment.frame, path), _units(segment.rows, path))
            return useable_span(times, segment, context, path), turns

        return pieced([*map(between, read_aem(path, self.craft))], context, path, close=(CLOSE_TURN, "radians"))


class Listed(AttitudeFile, frozen=True, kw_only=True, tag_field="kind", tag="list"):
    """A list of attitudes: each line has seconds and w, x, y, z of the rotation from the craft's axes to the frame's,
    separated by commas or blanks."""

    frame: str = "GCRF"

    def rotations(self, sight: Sight) -> Float:
        context, path = sight.context, sight.context.path(self.file)
        rows: list[list[float]] = []
        for number, line in enumerate(lines_of(path, MAX_POSE_LIST), 1):
            words = line.replace(",", " ").replace(";", " ").split()
            if not words or words[0].startswith("#") or (not rows and words[0][:1].isalpha()):
                continue
            try:
                rows.append([float(word) for word in words])
            except ValueError:
                raise InputError("contains text that is not a number", where=f"{path}, line {number}") from None
            if len(words) != 5 or not np.isfinite(rows[-1]).all():
                do = "give seconds, w, x, y, z"
                raise InputError("does not have five finite numbers", where=f"{path}, line {number}", do=do)
        table = np.array(rows).reshape(-1, 5)
        times = ordered(table[:, 0], path)
        smooth = _smooth(context, times, frame_named(self.frame, path), _units(table[:, 1:], path))
        return pieced([((float(times[0]), float(times[-1])), smooth)], context, path)


class Pointing(_Attitude, frozen=True, kw_only=True, tag_field="kind", tag="pointing"):
    """One axis of the craft points at an object, a second one as close as possible to another object."""

    axis: Annotated[Vector, Meta(description="Axis of the craft that points.")] = (0.0, 0.0, 1.0)
    at: Annotated[Where, Meta(description="Object that the axis points at: a name, or a direction in GCRF.")]
    second: Annotated[Vector, Meta(description="Second axis of the craft.")] = (0.0, 1.0, 0.0)
    towards: Annotated[Where, Meta(description="Object that the second axis points towards.")] = "nadir"

    def __post_init__(self) -> None:
        for name in (self.at, self.towards):
            if isinstance(name, str) and name not in DIRECTIONS:
                raise InputError(f"points at {name[:40]!r}", do=f"choose among {', '.join(DIRECTIONS)}, or X, Y, Z")

    def rotations(self, sight: Sight) -> Float:
        sought = (_direction(each, sight) for each in (self.at, self.towards))
        there = _axes(*(np.broadcast_to(each, sight.own[:, :3].shape) for each in sought))
        here = _axes(*(np.array([each], np.float64) for each in (self.axis, self.second)))
        if np.isnan(here).any():
            found = f"has axis {self.axis} and second {self.second}, which are parallel, or 0"
            raise InputError(found, where="pointing", do="choose another axis for `second`")
        if len(bad := np.flatnonzero(np.isnan(there).any((1, 2)))):
            at = f"at second {sight.context.epochs.seconds[bad[0]]:g}"
            found = f"points at {self.at} and towards {self.towards}, which are parallel or have no direction {at}"
            raise InputError(found, where="pointing", do="choose another object for `towards`")
        return np.asarray(there @ here[0].T)


class Inertial(_Attitude, frozen=True, kw_only=True, tag_field="kind", tag="inertial"):
    """A fixed attitude among the stars."""

    q: Annotated[Unit, Meta(description="w, x, y, z of the rotation from the craft's axes to the frame's.")]
    frame: str = "GCRF"

    def rotations(self, sight: Sight) -> Float:
        start = Epochs(sight.context.epochs.epoch, np.zeros(1)).axes_of(frame_named(self.frame, "frame"))[0]
        turn = start @ rotation_of(self.q, "q")
        return np.broadcast_to(turn, (len(sight.own), 3, 3))


class Tumbling(_Attitude, frozen=True, kw_only=True, tag_field="kind", tag="tumbling"):
    """Torque-free rotation."""

    q: Annotated[Unit, Meta(description="At second 0: w, x, y, z of the rotation from its axes to GCRF.")]
    rate_deg_s: Annotated[Vector, Meta(description="Angular velocity at second 0, in its axes.")]
    inertia: Inertia = named(name="inertia_kg_m2", default=(1.0, 1.0, 1.0))

    def __post_init__(self) -> None:
        tensor_of(self.inertia)
        if not np.linalg.norm(self.rate_deg_s) <= FASTEST:
            raise InputError(f"rate_deg_s is above {FASTEST:g}", do="check its unit")

    def rotations(self, sight: Sight) -> Float:
        start = rotation_of(self.q, "q")
        rate, inertia, seconds = np.radians(self.rate_deg_s), tensor_of(self.inertia), sight.context.epochs.seconds
        if np.linalg.norm(rate) * np.abs(seconds).max() > MOST_TURNS * 2 * np.pi:
            do = "shorten the scenario, or give an attitude ephemeris (aem)"
            raise InputError(f"turns more than {MOST_TURNS} times", where="tumbling", do=do)
        found = np.empty((len(seconds), 3, 3))
        for sign in (1, -1):  # backwards it turns as one with the opposite rate does forwards
            chosen = seconds >= 0 if sign > 0 else seconds < 0
            order = np.argsort(np.abs(seconds[chosen]))
            if chosen.any():
                q = tumbled(sign * rate, inertia, np.abs(seconds[chosen])[order])
                found[np.flatnonzero(chosen)[order]] = start @ matrices_from_quaternions(q)
        return found


AnyAttitude = Aem | Listed | Pointing | Inertial | Tumbling


def _direction(where: Where, sight: Sight) -> Float:
    return DIRECTIONS[where](sight) if isinstance(where, str) else np.array([where])


def _axes(first: Float, second: Float) -> Float:
    """Return rotations (N, 3, 3) whose columns are `first`, the normal of both, and the normal of these two; NaN where
    the vectors (N, 3) are parallel or zero."""
    with np.errstate(invalid="ignore", divide="ignore"):
        first = first / np.linalg.norm(first, axis=-1, keepdims=True)
        across = np.cross(first, second / np.linalg.norm(second, axis=-1, keepdims=True))
        sine = np.linalg.norm(across, axis=-1, keepdims=True)
        across = np.where(sine > ALONG, across / sine, np.nan)
    return np.stack([first, across, np.cross(first, across)], -1)


def rotation_of(q: Unit, where: object) -> Float:
    """Return the rotation (3, 3) of a quaternion. Raises InputError if its norm is not 1."""
    return np.asarray(matrices_from_quaternions(_units(np.array([q]), where))[0])


def _units(q: Float, where: object) -> Float:
    norm = np.linalg.norm(q, axis=1)
    if not (np.abs(norm - 1) <= QUATERNION_NORM_ROUNDED).all():
        i = int(np.argmax(~(np.abs(norm - 1) <= QUATERNION_NORM_ROUNDED)))
        raise InputError(f"quaternion {i + 1} has norm {norm[i]:.6g}, expected 1", where=where, do="normalise it")
    return np.asarray(q / norm[:, None])


def _smooth(context: OrbitContext, times: Float, frame: str, q: Float) -> At:
    """Return a function that interpolates rotations smoothly between the quaternions `q` (M, 4) at the times (M,),
    which turn to the axes of `frame`."""
    from scipy.spatial.transform import Rotation, RotationSpline

    turns = Epochs(context.epochs.epoch, times).axes_of(frame) @ matrices_from_quaternions(q)
    spline = RotationSpline(times, Rotation.from_matrix(turns))
    return lambda at: np.asarray(spline(at).as_matrix())
