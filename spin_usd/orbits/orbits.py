"""The kinds of orbit in a scenario: each gives a craft's states at the scenario's epochs."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from msgspec import field as named

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_MODEL, MAX_SPECIFICATION
from spin_usd.files.user_file import open_file
from spin_usd.formats.ccsds_file import EphemerisSegment, read_oem
from spin_usd.formats.text_file import read_any_text
from spin_usd.orbits.epochs import TEME, Epochs, frame_named
from spin_usd.orbits.propagation import (
    GM,
    J2,
    RADIUS,
    acceleration,
    from_relative_elements,
    from_relative_state,
    propagated,
    state_of,
)
from spin_usd.sampling.distribution import Vector

LONGEST_S = 3e6  # takes 12 s, up to eight times for two craft
CLOSE_M = 0.01  # error of an ephemeris between its states below which there is no note
MARGIN_S = 1.0  # by which a file is extrapolated beyond its span
FRESH_DAYS = 3.0  # of a TLE
TLE_KM, TLE_KM_A_DAY = 1.0, 2.0
"""Error of a TLE's orbit at its epoch, and its growth per day. Source: Vallado and Crawford, "SGP4 orbit
determination" (2008): about 1 km at the epoch, growing by 1 to 3 km a day."""
MAX_AWAY = 2e9  # metres from the Earth's centre, beyond any orbit about it
TLE_LINE = re.compile(r"[12] [ 0-9A-Z]\d{4}[U0-9A-Z ]? ")


At = Callable[[Float], Float]
"""Gives something at seconds (N,)."""
Piece = tuple[tuple[float, float], At]
"""First and last second of a part of a file, and its values."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OrbitContext:
    """The context in which an orbit is computed."""

    epochs: Epochs
    folder: Path
    """Folder of the scenario's files."""
    j2: bool = True
    other: Float | None = None
    """(6,) the other craft's state at second 0; None if unknown."""
    notes: dict[str, None] = field(default_factory=dict)
    """Sentences for the user, in their order."""

    def path(self, name: str) -> Path:
        return self.folder / name

    def pole(self) -> Float:
        """The Earth's pole (3,) in the middle of the scenario."""
        middle = Epochs(self.epochs.epoch, self.epochs.seconds[len(self.epochs.seconds) // 2 :][:1])
        return np.asarray(middle.R_gcrf_itrf[0, :, 2])

    def propagated(self, start: Float, where: str) -> Float:
        """Return the states (N, 6), GCRF, propagated from `start` at second 0."""
        if not np.isfinite(start).all() or not np.linalg.norm(np.cross(start[:3], start[3:])) > 0:
            raise InputError("is not an orbit about the Earth", where=where, do="check the numbers and their units")
        if np.abs(self.epochs.seconds).max() > LONGEST_S:
            do = "give an ephemeris (oem, spice) for longer"
            raise InputError(f"is propagated for more than {LONGEST_S / 86400:.0f} days", where=where, do=do)
        try:
            return propagated(start, self.epochs.seconds, self.pole(), J2 if self.j2 else 0.0)
        except InputError as error:
            raise InputError(error.found, where=where, do=error.do) from None


class _Orbit(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An orbit in a scenario. `states` returns positions and velocities (N, 6) in GCRF, metres, at the epochs, and
    raises InputError.

    relative: True if relative to the other craft · propagated: True if propagated by us · files: names of its files.
    """

    relative = False
    propagated = False

    @property
    def files(self) -> tuple[str, ...]:
        return ()


class OrbitFile(_Orbit, frozen=True, kw_only=True):
    """An orbit in a file."""

    file: Annotated[str, Meta(description="Beside the scenario.")]
    craft: Annotated[str | None, Meta(description="Craft in a file of several, by its name or id.")] = named(
        name="object", default=None
    )

    @property
    def files(self) -> tuple[str, ...]:
        return (self.file,)


class Oem(OrbitFile, frozen=True, kw_only=True, tag_field="kind", tag="oem"):
    """A CCSDS orbit ephemeris, KVN or XML. Quintics between its states match positions, velocities and the Earth's
    acceleration."""

    def states(self, context: OrbitContext) -> Float:
        from scipy.interpolate import BPoly

        epochs, path = context.epochs, context.path(self.file)
        pole = context.pole()

        def between(segment: EphemerisSegment) -> Piece:
            times = ordered(epochs.seconds_of(segment.times, segment.time_system, path), path)
            rows = Epochs(epochs.epoch, times).states_from(frame_named(segment.frame, path), segment.rows)
            known = np.stack([rows[:, :3], rows[:, 3:], acceleration(rows[:, :3], pole)], 1)
            path_of = BPoly.from_derivatives(times, known)
            off = _off_between(times, rows)
            if off > CLOSE_M:
                step = float(np.diff(times).max())
                context.notes[
                    f"{path.name} has states up to {step:g} s apart; expect up to {off:.2g} m of error between them"
                ] = None
            span = useable_span(times, segment, context, path)
            return span, lambda at: np.concatenate([path_of(at), path_of.derivative()(at)], -1)

        return pieced([*map(between, read_oem(path, self.craft))], context, path, close=(CLOSE_M, "m"))


def _off_between(times: Float, rows: Float) -> float:
    """Return the approximate error, metres, of quintics between states (N, 6): Hermite's remainder for a circle."""
    far = np.linalg.norm(rows[:, :3], axis=1)
    turned = np.diff(times) * np.sqrt(GM / far[1:] ** 3)
    return float((far[1:] * turned**6 / 46080).max())  # 6! times 2^6


class Tle(OrbitFile, frozen=True, kw_only=True, tag_field="kind", tag="tle"):
    """Two-line elements, propagated by SGP4."""

    def states(self, context: OrbitContext) -> Float:
        from sgp4.api import SGP4_ERRORS, Satrec
        from sgp4.io import verify_checksum

        path, epochs = context.path(self.file), context.epochs
        lines = [line.rstrip() for line in read_any_text(path, MAX_SPECIFICATION).splitlines() if line.strip()]
        pair = [line for line in lines if TLE_LINE.match(line)]
        if [line[0] for line in pair] != ["1", "2"] or pair[0][2:7] != pair[1][2:7] or min(map(len, pair)) < 69:
            raise InputError("does not contain one TLE", where=path, do="give its two lines, with or without its name")
        try:
            verify_checksum(*pair)
            craft = Satrec.twoline2rv(*pair)
        except ValueError as error:
            raise InputError(f"is not a valid TLE ({error})", where=path, do="copy it again") from None
        times = epochs.time.utc
        errors, places, velocities = craft.sgp4_array(times.jd1, times.jd2)
        if errors.any():
            raise InputError(f"has no orbit at these epochs: {SGP4_ERRORS[int(errors.max())]}", where=path)
        days = float(np.abs(times.jd - craft.jdsatepoch - craft.jdsatepochF).max())
        if days > FRESH_DAYS:
            off = TLE_KM + TLE_KM_A_DAY * days
            context.notes[f"{path.name} is {days:.0f} days from its epoch; expect about {off:.0f} km of error"] = None
        return epochs.states_from(TEME, np.concatenate([places, velocities], -1) * 1e3)


class Spice(_Orbit, frozen=True, kw_only=True, tag_field="kind", tag="spice"):
    """The user's own SPICE kernels."""

    kernels: Annotated[tuple[str, ...], Meta(min_length=1, description="Beside the scenario; SPK.")]
    body: Annotated[str, Meta(description="Its name, or its number.")]

    @property
    def files(self) -> tuple[str, ...]:
        return self.kernels

    def states(self, context: OrbitContext) -> Float:
        import spiceypy

        for name in self.kernels:
            open_file(context.path(name), MAX_MODEL).close()  # so that no library opens a pipe
        try:
            spiceypy.furnsh([str(context.path(name)) for name in self.kernels])
            et = (context.epochs.time.tdb.jd1 - 2451545.0) * 86400 + context.epochs.time.tdb.jd2 * 86400
            rows = [spiceypy.spkezr(self.body, float(time), "J2000", "NONE", "EARTH")[0] for time in et]
        except spiceypy.utils.exceptions.SpiceyError as error:
            said = (getattr(error, "long", "") or getattr(error, "short", "") or str(error)).split(". ")[0]
            raise InputError(f"gives no orbit of {self.body}: {said[:160]}", where=", ".join(self.kernels)) from None
        finally:
            spiceypy.kclear()
        return np.array(rows) * 1e3


class _Propagated(_Orbit, frozen=True, kw_only=True):
    propagated = True


class Keplerian(_Propagated, frozen=True, kw_only=True, tag_field="kind", tag="keplerian"):
    """Osculating elements at second 0, propagated from there."""

    semi_major_axis: float = named(name="semi_major_axis_m")
    eccentricity: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    inclination_deg: float
    node_deg: Annotated[float, Meta(description="Right ascension of the ascending node.")] = 0.0
    perigee_deg: Annotated[float, Meta(description="Argument of the perigee.")] = 0.0
    mean_anomaly_deg: float = 0.0
    frame: str = "GCRF"

    def __post_init__(self) -> None:
        if not RADIUS < self.semi_major_axis * (1 - self.eccentricity) < MAX_AWAY:
            do = f"give metres, with the perigee more than {RADIUS / 1e3:.0f} km from the Earth's centre"
            raise InputError(f"semi_major_axis_m {self.semi_major_axis:g} meets the ground, or is too large", do=do)

    def states(self, context: OrbitContext) -> Float:
        angles = np.radians([self.inclination_deg, self.node_deg, self.perigee_deg, self.mean_anomaly_deg])
        start = state_of(self.semi_major_axis, self.eccentricity, *angles.tolist())
        return context.propagated(_at_start(start, self.frame, context), "keplerian")


class StateVector(_Propagated, frozen=True, kw_only=True, tag_field="kind", tag="state"):
    """A state at second 0, propagated from there."""

    place: Vector = named(name="place_m")
    velocity: Vector = named(name="velocity_m_s")
    frame: str = "GCRF"

    def states(self, context: OrbitContext) -> Float:
        start = np.array([*self.place, *self.velocity])
        return context.propagated(_at_start(start, self.frame, context), "state")


class RelativeState(_Propagated, frozen=True, kw_only=True, tag_field="kind", tag="relative_state"):
    """A state relative to the other craft at second 0, in its rotating radial, transverse and normal axes; propagated
    from there."""

    relative = True
    place: Vector = named(name="place_m")
    velocity: Vector = named(name="velocity_m_s", default=(0.0, 0.0, 0.0))

    def states(self, context: OrbitContext) -> Float:
        assert context.other is not None
        start = from_relative_state(context.other, np.array(self.place), np.array(self.velocity))
        return context.propagated(start, "relative_state")


class RelativeElements(_Propagated, frozen=True, kw_only=True, tag_field="kind", tag="relative_elements"):
    """Quasi-nonsingular elements relative to the other craft at second 0, times its semi-major axis, metres; propagated
    from there."""

    relative = True
    da: float = named(name="a_da_m", default=0.0)
    dlambda: float = named(name="a_dlambda_m", default=0.0)
    dex: float = named(name="a_dex_m", default=0.0)
    dey: float = named(name="a_dey_m", default=0.0)
    dix: float = named(name="a_dix_m", default=0.0)
    diy: float = named(name="a_diy_m", default=0.0)

    def states(self, context: OrbitContext) -> Float:
        assert context.other is not None
        elements = np.array([self.da, self.dlambda, self.dex, self.dey, self.dix, self.diy])
        try:
            start = from_relative_elements(context.other, elements)
        except InputError as error:
            raise InputError(error.found, where="relative_elements", do=error.do) from None
        return context.propagated(start, "relative_elements")


AnyOrbit = Oem | Tle | Spice | Keplerian | StateVector | RelativeState | RelativeElements


def _at_start(state: Float, frame: str, context: OrbitContext) -> Float:
    """Return a state at second 0 in GCRF."""
    start = Epochs(context.epochs.epoch, np.zeros(1))
    return np.asarray(start.states_from(frame_named(frame, "frame"), state[None])[0])


def ordered(times: Float, path: Path) -> Float:
    """Return the times of a file, two or more and increasing. Raises InputError."""
    if len(times) < 2:
        raise InputError(f"has {len(times) or 'no'} state{'s' * (not len(times))}", where=path, do="give two or more")
    if len(back := np.flatnonzero(np.diff(times) <= 0)):
        i = int(back[0]) + 1
        found = f"goes back by {times[i - 1] - times[i]:g} s at state {i + 1}"
        raise InputError(found, where=path, do="sort the states by time")
    return times


def useable_span(times: Float, segment: EphemerisSegment, context: OrbitContext, path: Path) -> tuple[float, float]:
    """Return the first and last second of a segment's states that its file declares useable. Raises InputError."""
    first, last = (
        float(context.epochs.seconds_of([text], segment.time_system, path)[0]) if text else end
        for text, end in zip(segment.useable, (-np.inf, np.inf), strict=True)
    )
    return max(float(times[0]), first), min(float(times[-1]), last)


def pieced(
    pieces: Sequence[Piece], context: OrbitContext, path: Path, *, close: tuple[float, str] = (np.inf, "")
) -> Float:
    """Return the values of a file's pieces at the epochs (N,). A piece is beyond its span where no other has values.
    `close`: difference between two pieces, with its unit, beyond which a note tells that the later one is used. Raises
    InputError for epochs outside all pieces."""
    seconds, found = context.epochs.seconds, None
    said = np.zeros(len(seconds), bool)
    parts = [(span, at, margin) for margin in (0.0, MARGIN_S) for span, at in pieces]
    for (first, last), at, margin in parts:
        chosen = (seconds >= first - margin) & (seconds <= last + margin) & ~(said & (margin > 0))
        if not chosen.any():
            continue
        values = at(seconds[chosen])
        found = np.empty((len(seconds), *values.shape[1:])) if found is None else found
        twice = said[chosen]
        if twice.any() and np.abs(values - found[chosen])[twice][:, :3].max() > close[0]:
            differ = f"differ by more than {close[0]:g} {close[1]}; the later one is used"
            context.notes[f"{path.name} has segments that overlap and {differ}"] = None
        found[chosen], said = values, said | chosen
    if found is None or not said.all():
        second = float(seconds[np.argmin(said)])
        raise InputError(f"has no state at second {second:g}", where=path, do="choose times within its useable span")
    return found
