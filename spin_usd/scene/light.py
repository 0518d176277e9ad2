"""Lights, in physical units: radiance in W/m2/sr, irradiance in W/m2, radiant intensity in W/sr; linear RGB.

Positions and directions are in the camera frame `cam`, metres. Sources are not seen by the camera themselves, except a
dome, which is also what lies behind everything; reflections show all of them.
"""

from dataclasses import dataclass, field

from spin_usd.geometry.transform import Transform
from spin_usd.scene.content import NAME
from spin_usd.scene.texture import Color, Image

Links = frozenset[int] | None
"""Numbers of the face groups (Mesh.face_group) that a light reaches; None for all of them."""


@dataclass(frozen=True, kw_only=True)
class DistantLight:
    """A Sun. `direction_cam` (unit) is where its light travels *to*; `irradiance` is that of a plane that faces all of
    it, as on planets; `obscuration` is the share of it that planets keep away from the target; `angle` is its angular
    diameter in radians. `lights` and `shadowed_by` are light links."""

    path: str = field(compare=False, metadata=NAME)
    direction_cam: tuple[float, float, float]
    irradiance: Color
    angle: float = 0.0
    obscuration: float = 0.0
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
    """UsdLux.ShapingAPI. With t the angle of the emitted ray from -z (radians): emission is multiplied by
    1 - smoothstep(t, from `cone_angle` * (1 - `softness`) to `cone_angle`), nothing beyond it (pi is no cone), and by
    lerp(|cos t| ** `focus`, from `focus_tint` to white)."""

    cone_angle: float
    softness: float = 0.0
    focus: float = 0.0
    focus_tint: Color = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class AreaLight:
    """A source with a place. `shape` and `size` in metres:

    sphere (radius,) · disk (radius along x, radius along y) and rect (width, height) in the plane z = 0, shining along
    -z · cylinder (length, radius) along x, without ends · point () .
    `emission`: the radiance of every point of its surface; of a point its radiant intensity.
    `image`: of a rect, multiplies the emission; seen upright from the side that is lit.
    """

    path: str = field(metadata=NAME)
    shape: str
    size: tuple[float, ...]
    T_cam_light: Transform
    emission: Color
    shaping: Shaping | None = None
    image: Image | None = None
    shadows: bool = True
    lights: Links = None
    shadowed_by: Links = None


@dataclass(frozen=True, kw_only=True, eq=False)
class DomeLight:
    """Light from all around, infinitely far: `radiance`, times `image` where there is one: latitude-longitude, its top
    row the dome's +y, its centre column -z of the dome's axes, +x a quarter of the width right of that."""

    path: str = field(metadata=NAME)
    T_cam_dome: Transform
    radiance: Color
    image: Image | None = None


Light = DistantLight | AreaLight | DomeLight
