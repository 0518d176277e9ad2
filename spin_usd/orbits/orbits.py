"""The kinds of orbit in a scenario: each gives a craft's states at the scenario's epochs."""

import re
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from msgspec import field as named

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_MODEL
from spin_usd.files.user_file import open_file
from spin_usd.formats.ccsds_file import EphemerisSegment, read_oem
from spin_usd.orbits.epochs import TEME, Epochs, frame_named
from spin_usd.orbits.mean_elements import read_elements
from spin_usd.orbits.orbit_context import OrbitContext
from spin_usd.orbits.pieces import Piece, ordered, pieced, useable_span
from spin_usd.orbits.propagation import (
    GM,
    RADIUS,
    acceleration,
    from_relative_elements,
    from_relative_state,
    state_of,
)
from spin_usd.sampling.distribution import Vector

CLOSE_M = 0.01  # error of an ephemeris between its states below which there is no note
META_KERNEL, HEAD_BYTES, MOST_KERNELS = b"KERNELS_TO_LOAD", 1 << 16, 1000
FRESH_DAYS = 3.0  # of a TLE
TLE_KM, TLE_KM_A_DAY = 1.0, 2.0
"""Error of a TLE's orbit at its epoch, and its growth per day. Source: Vallado and Crawford, "SGP4 orbit
determination" (2008): about 1 km at the epoch, growing by 1 to 3 km a day."""
MAX_AWAY = 2e9  # metres from the Earth's centre, beyond any orbit about it


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
    """Two-line elements or an OMM, propagated by SGP4."""

    def states(self, context: OrbitContext) -> Float:
        from sgp4.api import SGP4_ERRORS

        path, epochs = context.path(self.file), context.epochs
        craft, times = read_elements(path, self.craft), epochs.time.utc
        errors, places, velocities = craft.sgp4_array(times.jd1, times.jd2)
        if errors.any() or not np.isfinite(places).all():
            said = SGP4_ERRORS.get(int(errors.max()), "its elements are not finite")
            raise InputError(f"has no orbit at these epochs: {said}", where=path)
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

        try:
            for name in self.kernels:
                for path in _kernels(context.path(name)):
                    open_file(path, MAX_MODEL).close()  # so that no library opens a pipe
                    spiceypy.furnsh(str(path))
            et = (context.epochs.time.tdb.jd1 - 2451545.0) * 86400 + context.epochs.time.tdb.jd2 * 86400
            rows = [spiceypy.spkezr(self.body, float(time), "J2000", "NONE", "EARTH")[0] for time in et]
        except spiceypy.utils.exceptions.SpiceyError as error:
            said = (getattr(error, "long", "") or getattr(error, "short", "") or str(error)).split(". ")[0]
            raise InputError(f"gives no orbit of {self.body}: {said[:160]}", where=", ".join(self.kernels)) from None
        finally:
            spiceypy.kclear()
        return np.array(rows) * 1e3


def _kernels(path: Path) -> list[Path]:
    """Return the kernel at that path, or those of a meta-kernel, relative to its folder, where SPICE takes the working
    directory."""
    import spiceypy

    with open_file(path, MAX_MODEL) as file:
        if META_KERNEL not in file.read(HEAD_BYTES):
            return [path]
    spiceypy.ldpool(str(path))
    lists = [_strings(name) for name in ("PATH_SYMBOLS", "PATH_VALUES", "KERNELS_TO_LOAD")]
    folders = {f"${symbol}": value for symbol, value in zip(lists[0], lists[1], strict=False)}
    names = [re.sub(r"\$\w+", lambda symbol: folders.get(symbol[0], symbol[0]), name) for name in lists[2]]
    spiceypy.dvpool("KERNELS_TO_LOAD")
    return [path.parent / name for name in names] or [path]


def _strings(name: str) -> list[str]:
    """Return the texts of a kernel variable, whose parts are joined after a "+"."""
    import spiceypy

    found: list[str] = []
    with suppress(spiceypy.utils.exceptions.SpiceyError, spiceypy.utils.exceptions.NotFoundError):
        while len(found) < MOST_KERNELS:
            found.append(spiceypy.stpool(name, len(found), "+")[0])
    return found


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
