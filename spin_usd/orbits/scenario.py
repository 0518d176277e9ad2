"""A scenario: two craft in Earth orbit, their attitudes, and the directions of Sun, Moon, Earth and stars."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct, to_builtins
from msgspec import field as named

from spin_usd.basics.arrays import Float
from spin_usd.basics.json_fields import Positive
from spin_usd.basics.progress import Progress, no_progress
from spin_usd.basics.utc import parsed_utc, utc_text
from spin_usd.errors import InputError
from spin_usd.geometry.motion import Motion, between
from spin_usd.geometry.motion import log as rotation_vector
from spin_usd.geometry.rotation import quaternion_from_matrix
from spin_usd.orbits.attitudes import AnyAttitude, Pointing, Sight, Unit, rotation_of
from spin_usd.orbits.epochs import Epochs
from spin_usd.orbits.orbit_context import OrbitContext
from spin_usd.orbits.orbits import MAX_AWAY, AnyOrbit
from spin_usd.sampling.distribution import Vector

DERIVATIVE_S = 0.01  # between the states that give a rate; rounding leaves an error of 1e-7 m/s
MAX_EPOCHS = 100_000
LOWEST = 6.35e6  # metres: the pole
LARGEST = 1e10  # metres, seconds, degrees: further than Pluto, longer than a life
MESSAGE, ROUNDS = "scenario: round", 4  # over all epochs
ORIGIN = (0.0, 0.0, 0.0)


class Craft(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One of the two craft."""

    orbit: AnyOrbit
    attitude: AnyAttitude | None = None
    centre_of_mass: Annotated[Vector, Meta(description="Point that follows the orbit, in its axes.")] = named(
        name="centre_of_mass_m", default=ORIGIN
    )


class Mounting(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Pose of the camera on the chaser; by default it has the chaser's axes."""

    q: Annotated[Unit, Meta(description="w, x, y, z of the rotation from the camera's axes to the chaser's.")] = (
        1.0,
        0.0,
        0.0,
        0.0,
    )
    place: Annotated[Vector, Meta(description="In the chaser's axes.")] = named(name="place_m", default=ORIGIN)


class Scenario(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The epochs of the pictures, and the two craft."""

    epoch: Annotated[str, Meta(description="UTC of second 0, such as 2026-03-01T12:00:00Z.")]
    duration: Positive | None = named(name="duration_s", default=None)
    step: Positive | None = named(name="step_s", default=None)
    times: Annotated[tuple[float, ...] | None, Meta(description="Instead of duration and step.")] = named(
        name="times_s", default=None
    )
    target: Craft
    chaser: Craft
    camera: Mounting = Mounting()
    j2: Annotated[bool, Meta(description="Whether propagation includes the Earth's flattening.")] = True
    stars: Annotated[float, Meta(description="Faintest magnitude of the stars; below -2 for no stars.")] = 6.5

    def __post_init__(self) -> None:
        if (self.times is None) != (self.duration is not None and self.step is not None) or (
            self.times is not None and (self.duration, self.step) != (None, None)
        ):
            raise InputError("needs either times_s, or duration_s with step_s", do="give one of them")
        if self.target.orbit.relative and self.chaser.orbit.relative:
            do = "give one of them an orbit about the Earth"
            raise InputError("has two relative orbits", do=do)
        if self.target.attitude is None:
            raise InputError("target has no attitude", do="add [target.attitude] with its kind")
        if bad := next((each for each in _numbers(to_builtins(self)) if not abs(each) <= LARGEST), None):
            raise InputError(f"contains {bad:g}, which is out of range", do="check the numbers and their units")
        seconds = self.seconds
        if len(seconds) > MAX_EPOCHS:
            raise InputError(f"has {len(seconds)} epochs, more than {MAX_EPOCHS}", do="take longer steps")
        if not (len(seconds) and np.isfinite(seconds).all()) or (np.diff(seconds) <= 0).any():
            raise InputError("times_s do not increase", do="sort them, each once")
        try:
            parsed_utc(self.epoch)
        except (ValueError, OverflowError):
            do = "write it as 2026-03-01T12:00:00Z"
            raise InputError(f"epoch {self.epoch[:40]!r} is not a UTC time", do=do) from None

    @property
    def seconds(self) -> Float:
        """The seconds (N,) after the epoch at which pictures are taken."""
        if self.times is not None:
            return np.array(self.times, np.float64)
        duration, step = self.duration or 0.0, self.step or 1.0
        count = min(int(np.floor(duration / step * (1 + 1e-12))) + 1, MAX_EPOCHS + 1)
        return np.asarray(step * np.arange(count, dtype=np.float64))

    @property
    def utc(self) -> str:
        """The epoch as `utc_text` writes it."""
        return utc_text(parsed_utc(self.epoch))

    @property
    def files(self) -> tuple[str, ...]:
        """The names of all its files."""
        named_by = (self.target.orbit, self.target.attitude, self.chaser.orbit, self.chaser.attitude)
        return tuple(dict.fromkeys(name for each in named_by if each for name in each.files))


def _numbers(value: Any) -> Iterator[float]:
    """Yield all numbers in tables and lists."""
    if isinstance(value, float | int):
        yield float(value)
    elif isinstance(value, dict | list | tuple):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _numbers(each)


@dataclass(frozen=True, kw_only=True, eq=False)
class Seen:
    """The camera's view at N epochs, in its axes: rotations (N, 3, 3) to them, positions (N, 3) in metres."""

    seconds: Float
    R_cam_body: Float
    t_cam_body: Float
    velocities: Float
    """Velocities of the target's origin, m/s."""
    rates: Float
    """The target's angular velocity, radians a second."""
    R_cam_gcrf: Float
    R_cam_earth: Float
    earth: Float
    """Position of the Earth's centre."""
    sun: Float
    moon: Float
    year: float
    """Decimal year of the epoch."""
    notes: tuple[str, ...]


def see(scenario: Scenario, seconds: Float, folder: Path, progress: Progress = no_progress) -> Seen:
    """Return the view of the scenario's camera at `seconds` (N,); `folder` holds the scenario's files. Raises
    InputError."""
    epochs = Epochs(scenario.utc, seconds)
    context = OrbitContext(epochs=epochs, folder=folder, j2=scenario.j2)
    context = replace(context, other=_absolute_start(scenario, context))
    found_poses = []
    for done, step in enumerate((0.0, -DERIVATIVE_S, DERIVATIVE_S)):
        progress(MESSAGE, done, ROUNDS)
        found_poses.append(_poses(scenario, _shifted(context, step)))
    now, before, after = found_poses
    progress(MESSAGE, len(found_poses), ROUNDS)
    turns = (b @ a.T for a, b in zip(before.R_cam_body, after.R_cam_body, strict=True))
    rates = np.array([rotation_vector(turn) for turn in turns]) / (2 * DERIVATIVE_S)
    velocities = (after.t_cam_body - before.t_cam_body) / (2 * DERIVATIVE_S)
    R_cam_gcrf, camera = now.R_cam_gcrf, now.camera
    if not epochs.predicted:
        context.notes["there is no prediction of the Earth's rotation; it may be off by up to 15 arcseconds"] = None

    def placed(body: Float) -> Float:
        return np.asarray(np.einsum("nij,nj->ni", R_cam_gcrf, body - camera))

    found = Seen(
        seconds=epochs.seconds,
        R_cam_body=now.R_cam_body,
        t_cam_body=now.t_cam_body,
        velocities=velocities,
        rates=rates,
        R_cam_gcrf=R_cam_gcrf,
        R_cam_earth=R_cam_gcrf @ epochs.R_gcrf_itrf,
        earth=placed(np.zeros_like(camera)),
        sun=placed(epochs.sun),
        moon=placed(epochs.moon),
        year=float(epochs.time.jyear[0]),
        notes=(),
    )
    return replace(found, notes=(*context.notes, *_between_pictures(scenario, context, found)))


def _absolute_start(scenario: Scenario, context: OrbitContext) -> Float | None:
    """Return the state (6,) at second 0 of the craft with the absolute orbit; None if neither orbit is relative."""
    pair = (scenario.target.orbit, scenario.chaser.orbit)
    if not any(orbit.relative for orbit in pair):
        return None
    absolute = next(orbit for orbit in pair if not orbit.relative)
    start = replace(context, epochs=Epochs(context.epochs.epoch, np.zeros(1)))
    try:
        return np.asarray(absolute.states(start)[0])
    except InputError as error:
        absolute.states(context)  # raises where second 0 is not the reason
        found = f"{error.found}, where the other, relative orbit begins"
        raise InputError(found, where=error.where, do=error.do) from None


def _shifted(context: OrbitContext, seconds: float) -> OrbitContext:
    return replace(context, epochs=context.epochs.after(seconds)) if seconds else context


@dataclass(frozen=True, kw_only=True, eq=False)
class _Poses:
    R_cam_body: Float
    t_cam_body: Float
    R_cam_gcrf: Float
    camera: Float
    """(N, 3) its position in GCRF."""


def _poses(scenario: Scenario, context: OrbitContext) -> _Poses:
    target, chaser = scenario.target.orbit.states(context), scenario.chaser.orbit.states(context)
    if context.other is not None and not (scenario.target.orbit.propagated and scenario.chaser.orbit.propagated):
        off = (chaser if scenario.target.orbit.relative else target) - context.propagated(context.other, "orbit")
        target, chaser = (target + off, chaser) if scenario.target.orbit.relative else (target, chaser + off)
    for name, states in (("target", target), ("chaser", chaser)):
        far = np.linalg.norm(states[:, :3], axis=1)
        if len(wrong := np.flatnonzero(~((far > LOWEST) & (far < MAX_AWAY)))):
            second = context.epochs.seconds[wrong[0]]
            found = f"is {far[wrong[0]]:.6g} m from the Earth's centre at second {second:g}"
            raise InputError(found, where=name, do="check the unit of its orbit: files have kilometres")
    assert scenario.target.attitude
    of_target = scenario.target.attitude.rotations(Sight(context=context, own=target, other=chaser))
    of_chaser = _of_chaser(scenario.chaser.attitude, Sight(context=context, own=chaser, other=target))
    body = target[:, :3] - of_target @ np.array(scenario.target.centre_of_mass)
    mounted = np.array(scenario.camera.place) - np.array(scenario.chaser.centre_of_mass)
    camera = chaser[:, :3] + of_chaser @ mounted
    R_cam_gcrf = np.swapaxes(of_chaser @ rotation_of(scenario.camera.q, "camera.q"), 1, 2)
    return _Poses(
        R_cam_body=R_cam_gcrf @ of_target,
        t_cam_body=np.einsum("nij,nj->ni", R_cam_gcrf, body - camera),
        R_cam_gcrf=R_cam_gcrf,
        camera=camera,
    )


def _of_chaser(attitude: AnyAttitude | None, sight: Sight) -> Float:
    """Return the chaser's rotations (N, 3, 3), by default pointing at the target, with its y axis towards the Earth."""
    if attitude:
        return attitude.rotations(sight)
    try:
        return Pointing(at="target").rotations(sight)
    except InputError as error:
        do = 'add [chaser.attitude] with kind = "pointing", at = "target" and towards = "velocity"'
        raise InputError(f"has no attitude, and the default {error.found}", where="chaser", do=do) from None


def _between_pictures(scenario: Scenario, context: OrbitContext, found: Seen) -> list[str]:
    """Return a note on the error of the cubics that interpolate motion between pictures, in the middle of each step."""
    steps = np.diff(found.seconds)
    if not len(steps) or steps.min() <= 0:
        return []
    middle = replace(context, epochs=Epochs(context.epochs.epoch, found.seconds[:-1] + steps / 2), notes={})
    true = _poses(scenario, middle)
    away, turned = 0.0, 0.0
    rows = zip(found.R_cam_body, found.t_cam_body, found.velocities, found.rates, strict=True)
    states = [Motion(rotation=r, place=t, velocity=v, rate=w) for r, t, v, w in rows]
    for i, step in enumerate(steps.tolist()):
        rotation, place = between(states[i], states[i + 1], step, step / 2)
        away = max(away, float(np.linalg.norm(place - true.t_cam_body[i])))
        turned = max(turned, float(np.linalg.norm(rotation_vector(rotation.T @ true.R_cam_body[i]))))
    off = f"{away:.2g} m and {np.degrees(turned):.2g} degrees"
    return [f"between pictures the target's motion differs from the scenario's by at most {off}"]


def quaternions_of(rotations: Float) -> Float:
    """Return the quaternions (N, 4), scalar first, of rotations (N, 3, 3)."""
    return np.array([quaternion_from_matrix(each) for each in rotations])
