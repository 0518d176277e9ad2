"""A LiDAR: how it is mounted, where its beams go, how far it sees, and how its ranges err."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import GeometryError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.lidar.beams import FLAT, PATTERNS, beam_directions

MAX_BEAMS = 1 << 22  # four million: their directions take 100 MB
WIDEST_FLAT_DEG = 85.0  # from a plane's normal: further out its rows crowd


@dataclass(frozen=True, kw_only=True, eq=False)
class Lidar:
    """A LiDAR of one scene. Its axes are x forward, y left, z up; T_cam_lidar maps them to the camera's.

    pattern: a name of lidar.beams.PATTERNS, which says what rows, columns and the spans of azimuth and elevation,
    degrees, are · range_limits: the least and the largest range that it measures, metres · noise_constant, metres, and
    noise_proportional, a share of the range: the standard deviation of a range is their sum · drop_out: share of the
    returns that are lost by chance · max_incidence_deg: from the surface's normal, degrees: a beam that meets a surface
    at a larger angle does not come back.
    """

    T_cam_lidar: Transform
    pattern: str = "raster"
    rows: int = 128
    columns: int = 128
    azimuth_deg: tuple[float, float] = (-10.0, 10.0)
    elevation_deg: tuple[float, float] = (-10.0, 10.0)
    range_limits: tuple[float, float] = (0.1, 1000.0)
    noise_constant: float = 0.0
    noise_proportional: float = 0.0
    drop_out: float = 0.0
    max_incidence_deg: float = 90.0

    def __post_init__(self) -> None:
        for wrong, found in self._conditions():
            if wrong:
                raise GeometryError(found)

    def _conditions(self) -> tuple[tuple[bool, str], ...]:
        """Return what must not hold, each with the sentence that says so."""
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
        """Return whether chance decides some of what it measures."""
        return bool(self.noise_constant or self.noise_proportional or self.drop_out)

    def sigma(self, ranges: Float) -> Float:
        """Return the standard deviations (N,) of the measured `ranges` (N,), metres."""
        return self.noise_constant + self.noise_proportional * ranges

    def as_json(self) -> dict[str, Any]:
        """Return what a record says of it: the fields, with T_cam_lidar as quaternion and translation."""
        rest = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "T_cam_lidar"}
        pose = self.T_cam_lidar
        return {
            "q_cam_lidar": pose.quaternion.tolist(),
            "t_cam_lidar": pose.translation.tolist(),
            **{name: list(value) if isinstance(value, tuple) else value for name, value in rest.items()},
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> "Lidar":
        """Make the LiDAR that a record describes. Raises GeometryError."""
        rest: dict[str, Any] = {name: tuple(it) if isinstance(it, list) else it for name, it in value.items()}
        q, t = rest.pop("q_cam_lidar"), rest.pop("t_cam_lidar")
        return cls(T_cam_lidar=Transform.from_quaternion(to="cam", of="lidar", q=q, t=t), **rest)
