"""Lights, in physical units: radiance in W/m2/sr, irradiance in W/m2, radiant intensity in W/sr; linear RGB.

Positions and directions are in the camera frame `cam`, metres. Sources are not seen by the camera themselves, except a
dome, which is also the background; reflections show all of them.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.transform import Transform
from spin_usd.scene.content import NAME
from spin_usd.scene.texture import Color, Image

Links = frozenset[int] | None
"""Numbers of the face groups (Mesh.face_group) that a light reaches; None for all of them."""


@dataclass(frozen=True, kw_only=True)
class DistantLight:
    """A Sun. `lights` and `shadowed_by` are light links."""

    path: str = field(compare=False, metadata=NAME)
    direction_cam: tuple[float, float, float]
    """Unit: where its light travels *to*."""
    irradiance: Color
    """Irradiance of a plane that faces all of it, as on planets."""
    angle: float = 0.0
    """Its angular diameter, radians."""
    obscuration: float = 0.0
    """The share of it that planets keep away from the target."""
    shadows: bool = True
    lights: Links = None
    shadowed_by: Links = None

    @property
    def at_target(self) -> Color:
        """The irradiance of a plane at the target that faces the light: none in a total eclipse."""
        r, g, b = (value * (1 - self.obscuration) for value in self.irradiance)
        return r, g, b


@dataclass(frozen=True, kw_only=True)
class Shaping:
    """UsdLux.ShapingAPI. With t the angle of the emitted ray from -z (radians): emission is multiplied by 1 -
    smoothstep(t, from `cone_angle` * (1 - `softness`) to `cone_angle`), nothing beyond it (pi: no cone), and by
    lerp(|cos t| ** `focus`, from `focus_tint` to white)."""

    cone_angle: float
    softness: float = 0.0
    focus: float = 0.0
    focus_tint: Color = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class AreaLight(ABC):
    """A source with a place: one of the classes below, which give its shape and its lengths in metres.

    It counts in keys by its shape and size, so that classes and fields can be renamed.
    """

    shape: ClassVar[str]
    lengths: ClassVar[tuple[str, ...]]
    """The names of the fields that hold its lengths."""

    path: str = field(metadata=NAME)
    T_cam_light: Transform
    emission: Color
    """The radiance of every point of its surface; a point's radiant intensity."""
    shaping: Shaping | None = None
    shadows: bool = True
    lights: Links = None
    shadowed_by: Links = None

    @property
    @abstractmethod
    def area(self) -> float:
        """The surface that emits, m2."""

    @property
    @abstractmethod
    def facing_area(self) -> float:
        """The area that it shows to those it faces, m2; 1 for a point, whose emission is an intensity."""

    @abstractmethod
    def projected_area(self, leaving: Float) -> Float:
        """Return (N,) the area that it shows along the unit directions `leaving` (N, 3) it, in its own axes, m2."""

    @property
    def size(self) -> tuple[float, ...]:
        """The light's lengths, metres."""
        return tuple(getattr(self, name) for name in self.lengths)

    def scaled(self, factor: float) -> Self:
        """Return the same light with its lengths `factor` times as long."""
        return replace(self, **{name: getattr(self, name) * factor for name in self.lengths})

    @property
    def digested(self) -> dict[str, Any]:
        """The values by which it counts in keys."""
        own = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("path", *self.lengths)}
        return {"": "AreaLight", "shape": self.shape, "size": self.size, "image": None, **own}


@dataclass(frozen=True, kw_only=True, eq=False)
class PointLight(AreaLight):
    """A source without size."""

    shape: ClassVar[str] = "point"
    lengths: ClassVar[tuple[str, ...]] = ()

    @property
    def area(self) -> float:
        return 0.0

    @property
    def facing_area(self) -> float:
        return 1.0

    def projected_area(self, leaving: Float) -> Float:
        return np.ones(len(leaving))


@dataclass(frozen=True, kw_only=True, eq=False)
class SphereLight(AreaLight):
    """A sphere, metres."""

    shape: ClassVar[str] = "sphere"
    lengths: ClassVar[tuple[str, ...]] = ("radius",)
    radius: float

    @property
    def area(self) -> float:
        return 4 * math.pi * self.radius**2

    @property
    def facing_area(self) -> float:
        return math.pi * self.radius**2

    def projected_area(self, leaving: Float) -> Float:
        return np.full(len(leaving), self.facing_area)


@dataclass(frozen=True, kw_only=True, eq=False)
class DiskLight(AreaLight):
    """An ellipse in the plane z = 0 that shines along -z; its semi-axes along x and y, metres."""

    shape: ClassVar[str] = "disk"
    lengths: ClassVar[tuple[str, ...]] = ("radius_x", "radius_y")
    radius_x: float
    radius_y: float

    @property
    def area(self) -> float:
        return math.pi * self.radius_x * self.radius_y

    @property
    def facing_area(self) -> float:
        return self.area

    def projected_area(self, leaving: Float) -> Float:
        return self.area * np.maximum(-leaving[:, 2], 0)


@dataclass(frozen=True, kw_only=True, eq=False)
class RectLight(AreaLight):
    """A rectangle in the plane z = 0 that shines along -z: `width` along x and `height` along y, metres. `image`
    multiplies the emission; it is seen upright from the side that is lit."""

    shape: ClassVar[str] = "rect"
    lengths: ClassVar[tuple[str, ...]] = ("width", "height")
    width: float
    height: float
    image: Image | None = None

    @property
    def area(self) -> float:
        return self.width * self.height

    @property
    def facing_area(self) -> float:
        return self.area

    def projected_area(self, leaving: Float) -> Float:
        return self.area * np.maximum(-leaving[:, 2], 0)


@dataclass(frozen=True, kw_only=True, eq=False)
class CylinderLight(AreaLight):
    """A cylinder along x, without ends; metres."""

    shape: ClassVar[str] = "cylinder"
    lengths: ClassVar[tuple[str, ...]] = ("length", "radius")
    length: float
    radius: float

    @property
    def area(self) -> float:
        return 2 * math.pi * self.length * self.radius

    @property
    def facing_area(self) -> float:
        return 2 * self.radius * self.length

    def projected_area(self, leaving: Float) -> Float:
        return np.asarray(self.facing_area * np.sqrt(np.maximum(1 - leaving[:, 0] ** 2, 0)))


@dataclass(frozen=True, kw_only=True, eq=False)
class DomeLight:
    """Light from all around, infinitely far: `radiance`, times `image` if there is one: latitude-longitude, its top row
    the dome's +y, its centre column -z of the dome's axes, +x a quarter of the width right of that."""

    path: str = field(metadata=NAME)
    T_cam_dome: Transform
    radiance: Color
    image: Image | None = None


Light = DistantLight | AreaLight | DomeLight
