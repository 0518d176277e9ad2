"""A LiDAR: how it is mounted, where its beams go, how far it sees, and how its ranges err; and a laser range finder.

Beams are patterns of unit directions in its own axes, x forward, y left, z up. Angles are degrees. Azimuth turns from
forward to the left, elevation upwards. Sines and cosines are Python's own: the last bits of numpy's depend on the
processor.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spin_usd.basics.arrays import Float, frozen
from spin_usd.errors import GeometryError
from spin_usd.geometry.directions import GOLDEN_ANGLE
from spin_usd.geometry.transform import Transform

MAX_BEAMS = 1 << 22  # four million: their directions take 100 MB
CONE_RAYS = 1000  # a share of a cone is off by some thousandth
WIDEST_CONE_DEG = 60.0  # no laser is as wide
WIDEST_FLAT_DEG = 85.0  # from a plane's normal: further out its rows crowd
Span = tuple[float, float]
GOLDEN = (math.sqrt(5) - 1) / 2  # turns of a rosette's second prism for one of its first: the pattern never closes


@dataclass(frozen=True, kw_only=True, eq=False)
class Lidar:
    """A LiDAR of one scene. Its axes are x forward, y left, z up; T_cam_lidar maps them to the camera's."""

    T_cam_lidar: Transform
    pattern: str = "raster"
    """A name of PATTERNS, which determines the meaning of the next four."""
    rows: int = 128
    columns: int = 128
    azimuth_deg: tuple[float, float] = (-10.0, 10.0)
    """The span of azimuths, degrees."""
    elevation_deg: tuple[float, float] = (-10.0, 10.0)
    """The span of elevations, degrees."""
    range_limits: tuple[float, float] = (0.1, 1000.0)
    """The least and the largest range that it measures, metres."""
    noise_constant: float = 0.0
    """Metres. The standard deviation of a range is the sum of this and the next."""
    noise_proportional: float = 0.0
    """A share of the range."""
    drop_out: float = 0.0
    """Share of the returns that are lost by chance."""
    max_incidence_deg: float = 90.0
    """The largest angle from the surface's normal, degrees, at which a beam comes back."""

    def __post_init__(self) -> None:
        for wrong, found in self._conditions():
            if wrong:
                raise GeometryError(found)

    def _conditions(self) -> tuple[tuple[bool, str], ...]:
        """Return the conditions to refuse, each with its message."""
        (left, right), (low, high) = self.azimuth_deg, self.elevation_deg
        near, far = self.range_limits
        widest = (WIDEST_FLAT_DEG, WIDEST_FLAT_DEG) if self.pattern in FLAT else (180.0, 90.0)
        errs = (self.noise_constant, self.noise_proportional)
        return (
            (self.pattern not in PATTERNS, f"the pattern is {self.pattern!r}, expected {' or '.join(PATTERNS)}"),
            (
                not (self.rows > 0 < self.columns and self.beams <= MAX_BEAMS),
                f"{self.rows} rows and {self.columns} columns are not 1 to {MAX_BEAMS} beams",
            ),
            (
                not -widest[0] <= left < right <= widest[0],
                f"the azimuths are {left:g} to {right:g} degrees, expected some of -{widest[0]:g} to {widest[0]:g}",
            ),
            (
                not -widest[1] <= low <= high <= widest[1] or (low == high and self.pattern in FLAT),
                f"the elevations are {low:g} to {high:g} degrees, expected some of -{widest[1]:g} to {widest[1]:g}",
            ),
            (not 0 <= near < far < np.inf, f"the range limits are {near:g} to {far:g} m, expected the lesser first"),
            (
                not all(0 <= each < np.inf for each in errs),
                f"the noise is {errs[0]:g} m and {errs[1]:g} of the range, expected numbers from 0 up",
            ),
            (not 0 <= self.drop_out < 1, f"the drop-out is {self.drop_out:g}, expected a share below 1"),
            (
                not 0 < self.max_incidence_deg <= 90,
                f"the largest incidence is {self.max_incidence_deg:g} degrees, expected above 0, to 90",
            ),
        )

    @property
    def beams(self) -> int:
        """The number of beams."""
        return self.rows * self.columns

    @property
    def directions(self) -> Float:
        """(B, 3) read-only unit directions of all beams in the LiDAR's axes."""
        return beam_directions(self.pattern, self.rows, self.columns, self.azimuth_deg, self.elevation_deg)

    @property
    def by_chance(self) -> bool:
        """Return whether some of its measurements are random."""
        return bool(self.noise_constant or self.noise_proportional or self.drop_out)

    def sigma(self, ranges: Float) -> Float:
        """Return the standard deviations (N,) of the measured `ranges` (N,), metres."""
        return self.noise_constant + self.noise_proportional * ranges


@dataclass(frozen=True, kw_only=True, eq=False)
class RangeFinder:
    """A laser range finder, which lights a cone evenly along the z axis of its own axes, x right, y down."""

    T_cam_finder: Transform
    """Maps its axes to the camera's."""
    divergence_deg: float
    """The full angle of the cone."""

    def __post_init__(self) -> None:
        if not 0 <= self.divergence_deg <= WIDEST_CONE_DEG:
            found = f"the divergence is {self.divergence_deg:g} degrees, expected 0 to {WIDEST_CONE_DEG:g}"
            raise GeometryError(found)

    @property
    def directions(self) -> Float:
        """(1 + CONE_RAYS, 3) unit directions in its own axes: the boresight, then a spiral that fills the cone evenly
        (H. Vogel, "A better way to construct the sunflower head", 1979)."""
        radius = math.tan(math.radians(self.divergence_deg) / 2)
        spiral = [(radius * math.sqrt((i + 0.5) / CONE_RAYS), i * GOLDEN_ANGLE) for i in range(CONE_RAYS)]
        x, y = np.array([(0.0, 0.0), *((r * math.cos(turn), r * math.sin(turn)) for r, turn in spiral)]).T
        return _unit(x, y, np.ones(len(x)))


def raster(rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the directions (rows x columns, 3) to a focal plane's pixels, row by row from the top left, as in a flash
    LiDAR: the spans cover the whole plane, and each beam goes to the middle of its pixel."""
    left, right = (math.tan(math.radians(angle)) for angle in reversed(azimuth))
    top, bottom = (math.tan(math.radians(angle)) for angle in reversed(elevation))
    y = left + (np.arange(columns) + 0.5) * ((right - left) / columns)
    z = top + (np.arange(rows) + 0.5) * ((bottom - top) / rows)
    return _unit(np.ones(1), np.tile(y, rows), np.repeat(z, columns))


def spinning(rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the directions (rows x columns, 3) of `rows` rings, the highest first, with `columns` equal steps each,
    from the left to the right: clockwise as seen from above. The elevations belong to the highest and the lowest ring;
    the azimuths are the ends of the steps, and each beam goes to the middle of its step."""
    step = (azimuth[1] - azimuth[0]) / columns
    turns = [math.radians(azimuth[1] - (i + 0.5) * step) for i in range(columns)]
    low, high = elevation
    rise = (high - low) / max(rows - 1, 1)
    rings = [math.radians(high - i * rise if rows > 1 else (high + low) / 2) for i in range(rows)]
    along, across = np.array([math.cos(a) for a in turns]), np.array([math.sin(a) for a in turns])
    level, up = np.array([math.cos(a) for a in rings]), np.array([math.sin(a) for a in rings])
    return _unit(np.outer(level, along).ravel(), np.outer(level, across).ravel(), np.repeat(up, columns))


def rosette(rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the directions (rows x columns, 3), in time, of a beam that two turning prisms bend: `rows` turns of the
    first, with `columns` beams each. The spans are the rosette's, whose leaves fill it evenly with time."""
    first = [2 * math.pi * ((i + 0.5) / columns % 1) for i in range(columns)]
    second = [-2 * math.pi * (GOLDEN * (i + 0.5) / columns % 1) for i in range(rows * columns)]
    u = (np.tile([math.cos(a) for a in first], rows) + [math.cos(a) for a in second]) / 2
    v = (np.tile([math.sin(a) for a in first], rows) + [math.sin(a) for a in second]) / 2
    left, right = (math.tan(math.radians(angle)) for angle in reversed(azimuth))
    top, bottom = (math.tan(math.radians(angle)) for angle in reversed(elevation))
    return _unit(np.ones(1), (left + right) / 2 + u * (left - right) / 2, (top + bottom) / 2 + v * (top - bottom) / 2)


PATTERNS: Mapping[str, Callable[[int, int, Span, Span], Float]] = {
    "raster": raster,
    "spinning": spinning,
    "rosette": rosette,
}
"""The patterns that there are. A new one is a function of these arguments and an entry here."""
FLAT = ("raster", "rosette")
"""Patterns that lie on a plane before the LiDAR, so that their angles are below 90 degrees."""


@lru_cache(maxsize=4)
def beam_directions(pattern: str, rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the read-only directions (rows x columns, 3) of the pattern of that name."""
    return frozen(PATTERNS[pattern](rows, columns, azimuth, elevation))


def _unit(x: Float, y: Float, z: Float) -> Float:
    length = np.sqrt(x * x + y * y + z * z)
    return np.stack([x / length, y / length, z / length], -1)
