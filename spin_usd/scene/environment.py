"""The environment, which is the background.

Units are metres in the camera frame `cam`, W/m2/sr, linear RGB.
"""

from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float, digest, finite
from spin_usd.errors import GeometryError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.content import NAME
from spin_usd.scene.texture import Color, Image

BACKGROUND = "background"
"""The parameter of specifications that puts other surroundings, or a photograph, behind a picture."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Planet:
    """An ellipsoid lit by the distant lights that light everything.

    It also lights the target if it `illuminates`; it is visible, and eclipses the lights, in any case. Its images have
    latitude and longitude, north at the top, longitude 0 in the middle column, east to the right. Latitude is the angle
    of the surface's normal.
    """

    path: str = field(metadata=NAME)
    T_cam_planet: Transform
    radii: tuple[float, float, float]
    """(3,): semi-axes along its own x, y, z, metres; z is its north."""
    albedo: Image | Color
    """Lambert's."""
    clouds: Image | None = None
    """Their albedo, and in alpha their opacity."""
    night: Image | None = None
    """An image of lights that are seen by day and night."""
    night_radiance: Color = (0.0, 0.0, 0.0)
    """Radiance of the white of `night`, W/m2/sr."""
    atmosphere: float = 0.0
    """Scale height in metres, 0 for none."""
    haze: Color = (0.0, 0.0, 0.0)
    """The optical depth straight down, RGB."""
    illuminates: bool = True
    appearance: int = field(default=4, init=False)
    """Counts changes of the painting of planets: it is an input of a picture's key."""

    def __post_init__(self) -> None:
        if not all(0 < radius < np.inf for radius in self.radii):
            raise GeometryError(f"planet {self.path} has the radii {self.radii}, expected above zero")


@dataclass(frozen=True, kw_only=True, eq=False)
class Stars:
    """Points at infinity: directions (N, 3), unit, in sky axes; irradiance (N, 3) RGB, W/m2, at the camera."""

    path: str = field(metadata=NAME)
    T_cam_sky: Transform
    directions: Float
    irradiance: Float

    def __post_init__(self) -> None:
        for name in ("directions", "irradiance"):
            object.__setattr__(self, name, finite(getattr(self, name), (None, 3), f"{name} of {self.path}"))
        if len(self.directions) != len(self.irradiance):
            raise GeometryError(f"{self.path} has {len(self.directions)} stars and {len(self.irradiance)} irradiances")

    def turned(self, T_cam_sky: Transform) -> "Stars":
        """Return the same stars in another attitude; neither is checked or digested again."""
        assert self._digests
        other = copy(self)
        object.__setattr__(other, "T_cam_sky", T_cam_sky)
        return other

    @property
    def digested(self) -> dict[str, Any]:
        """Result of `content`."""
        directions, irradiance = self._digests
        return {"": "Stars", "T_cam_sky": self.T_cam_sky, "directions": directions, "irradiance": irradiance}

    @cached_property
    def _digests(self) -> tuple[str, str]:
        return digest(self.directions), digest(self.irradiance)


@dataclass(frozen=True, kw_only=True, eq=False)
class BackPlate:
    """A picture behind everything, filling the frame; it hides domes and stars, and lights nothing.

    These choices are sampled from the picture's seed.
    """

    path: str = field(metadata=NAME)
    images: tuple[Image, ...]
    """One of these is shown."""
    radiance: Color
    """Radiance of the image's white."""
    probability: float = 1.0
    """The share of the pictures that have it."""
    roll: tuple[float, float] = (0.0, 0.0)
    """The range of the angle by which it is turned, radians."""
    mirror: float = 0.0
    """The probability that it is mirrored left to right."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Environment:
    """Planets, stars and a back plate; without any of them, deep space."""

    planets: tuple[Planet, ...] = ()
    stars: tuple[Stars, ...] = ()
    back_plate: BackPlate | None = None

    @property
    def illuminating(self) -> tuple[Planet, ...]:
        """The planets that light the target."""
        return tuple(planet for planet in self.planets if planet.illuminates)


@dataclass(frozen=True, kw_only=True, eq=False)
class Sky:
    """Places of Sun, target and planet in the pictures; arrays have one row for each picture, or one for all."""

    sun: Float | None
    """Unit directions to it."""
    target: Float
    """Its middle, metres, in a ball of `target_radius`."""
    target_radius: float
    planet: Float | None
    """Its centre, metres."""
    radii: tuple[float, float]
    """The planet's least and greatest semi-axis."""
    frame: Float
    """(M, 3): unit directions through the rim of the picture."""
