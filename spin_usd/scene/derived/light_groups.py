"""One render for every strength and colour of the lights: light is additive, and so is a path tracer's result.

A scene is rendered in unit light, each light in a group of its own; the picture is the sum of the groups, each times
its light's own red, green and blue. So strengths and colours only affect how a render shares out rays among the lights,
and for that the power of CLASS nearest to each light's share is close enough: equal shares would be noisy if one light
outshines the others.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.scene.content import key_of
from spin_usd.scene.light import DistantLight, DomeLight, Light
from spin_usd.scene.scene import Scene
from spin_usd.scene.target import Target
from spin_usd.scene.texture import Color

CLASS = 16.0
SHARE_DIGITS = 12  # lights that are dimmed together keep their shares, whatever the last bits do
WHITE: Color = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class UnitLight:
    """A scene in unit light."""

    scene: Scene
    """The scene as rendered, its lights white and of unit strength."""
    gains: tuple[Color, ...]
    """Factors for red, green and blue of each group of that render, for the picture."""


@dataclass(frozen=True, kw_only=True)
class LightGroups:
    """The light groups that a scene has, in the order of the fields; one that it lacks has no group."""

    placed: tuple[int, ...]
    """Indices into Scene.lights of those with a place or a direction that reach the target, a group each."""
    surroundings: bool
    """Whether domes and planets, one group together, light the target."""
    emission: bool
    """Whether its materials emit, another group."""

    @classmethod
    @lru_cache(maxsize=1)
    def of(cls, scene: Scene) -> "LightGroups":
        """Find the groups of `scene`, once for all callers."""
        placed = tuple(i for i, light in enumerate(scene.lights) if _is_placed(light))
        return cls(placed=placed, surroundings=bool(_around(scene)), emission=_shines(scene))

    @property
    def count(self) -> int:
        return len(self.placed) + self.surroundings + self.emission


def in_unit_light(scene: Scene) -> UnitLight:
    """`scene` in unit light, and the gains that make it the picture's own."""
    groups, around = LightGroups.of(scene), _around(scene)
    strengths = [_irradiance(light, scene) * _mean(emission_of(light)) for light in scene.lights]
    tied = around if scene.environment.illuminating else []  # planets are lit by them all in proportion
    most = max((strengths[i] for i in tied or range(len(strengths))), default=0.0)
    base = _class(most) if groups.emission else 1.0  # emission has no other reference than itself
    reference, scale = _around_reference(scene), 1.0
    shares = {i: _rounded(_divided(emission_of(scene.lights[i]), reference)) for i in around}
    if around:
        relative = [_irradiance(scene.lights[i], scene) * _mean(share) for i, share in shares.items()]
        scale = (
            base / max(relative) if tied else base * _class(sum(strengths[i] for i in around) / most) / sum(relative)
        )
    lights: list[Light] = []
    for i, light in enumerate(scene.lights):
        if i in shares:
            unit = _times(shares[i], scale)
        elif strengths[i]:
            unit = _times(WHITE, base * _class(strengths[i] / most) / _irradiance(light, scene))
        else:
            unit = emission_of(light)
        lights.append(_emitting(light, unit))
    gains = [_gain(scene.lights[i], lights[i]) for i in groups.placed]
    if groups.surroundings:
        gains.append(_times(reference, 1 / scale))
    if groups.emission:
        gains.append(WHITE)
    return UnitLight(scene=scene.with_lights(tuple(lights)), gains=tuple(gains))


def gains_in(unit: UnitLight, scene: Scene) -> tuple[Color, ...] | None:
    """Return the factors for each group of a render in that `unit` light for a picture of `scene`, whose lights differ
    from its own only in strength and colour; None if they differ in more, or one was dark then."""
    groups, around = LightGroups.of(unit.scene), _around(unit.scene)
    by_path = {light.path: light for light in scene.lights}  # USD orders children by who has opinions on them
    if by_path.keys() != {light.path for light in unit.scene.lights}:
        return None
    pairs = [(by_path[light.path], light) for light in unit.scene.lights]
    for own, of_unit in pairs:
        dark = any(emission_of(own)) and not any(emission_of(of_unit))
        if dark or type(own) is not type(of_unit) or key_of(_emitting(own, emission_of(of_unit))) != key_of(of_unit):
            return None
    gains = [_gain(*pairs[i]) for i in groups.placed]
    if groups.surroundings:
        shares = {
            _rounded(_divided(emission_of(own), emission_of(of_unit))) for own, of_unit in (pairs[i] for i in around)
        }
        if len(shares) > 1:
            return None
        gains += shares
    return (*gains, WHITE) if groups.emission else tuple(gains)


def strengths(scene: Scene) -> dict[str, Color]:
    """Return the number that the target's light is proportional to, by the path of each light."""
    return {light.path: _at_target(light) for light in scene.lights}


def _is_placed(light: Light) -> bool:
    return not isinstance(light, DomeLight) and any(_at_target(light))


def _around(scene: Scene) -> list[int]:
    """Indices of the lights from all around the target: domes, and lights of planets."""
    planets = bool(scene.environment.illuminating)
    return [
        i
        for i, light in enumerate(scene.lights)
        if any(emission_of(light)) and (isinstance(light, DomeLight) or (planets and _lights_planets(light)))
    ]


def _lights_planets(light: Light) -> bool:
    return isinstance(light, DistantLight) and light.lights is None


def _around_reference(scene: Scene) -> Color:
    """Return the colour that all light from around is proportional to: for red, green and blue each the first non-zero
    light's, else 0."""
    colours = [emission_of(scene.lights[i]) for i in _around(scene)]
    r, g, b = (next((colour[c] for colour in colours if colour[c]), 0.0) for c in range(3))
    return r, g, b


def _shines(scene: Scene) -> bool:
    return any(emits(body.target) for body in scene.bodies)


@lru_cache(maxsize=16)
def emits(target: Target) -> bool:
    """Return whether a material of the target emits, found once for all of its pictures."""
    return any(material.emissive_color != (0.0, 0.0, 0.0) for material in target.materials)


def emission_of(light: Light) -> Color:
    """Return the light's own number that is proportional to its strength."""
    if isinstance(light, DistantLight):
        return light.irradiance
    return light.radiance if isinstance(light, DomeLight) else light.emission


def _emitting(light: Light, emission: Color) -> Light:
    if isinstance(light, DistantLight):
        left = 1 - light.obscuration  # 0 in total eclipse: the target gets nothing, whatever the light's strength
        return replace(light, irradiance=emission, obscuration=1 - min(_class(left), 1.0) if left else 1.0)
    if isinstance(light, DomeLight):
        return replace(light, radiance=emission)
    return replace(light, emission=emission)


def _gain(light: Light, unit: Light) -> Color:
    return _divided(_at_target(light), _at_target(unit))


def _at_target(light: Light) -> Color:
    """Return the number that the target's light is proportional to."""
    return light.at_target if isinstance(light, DistantLight) else emission_of(light)


def _irradiance(light: Light, scene: Scene) -> float:
    """Return the irradiance at the first target over the light's emission, about: the solid angle of the source."""
    if isinstance(light, DistantLight):
        return 1.0
    if isinstance(light, DomeLight):
        return math.pi
    first = scene.bodies[0]
    place: Float = light.T_cam_light.translation - first.T_cam_body.points(first.target.mesh.centre)
    distance = max(float(np.linalg.norm(place)), first.target.mesh.radius)
    return min(light.facing_area / distance**2, math.pi)


def _class(ratio: float) -> float:
    """Return the power of CLASS that is nearest, by the logarithm."""
    if not 0 < ratio < math.inf:
        return 1.0
    return float(CLASS ** math.floor(math.log(ratio, CLASS) + 0.5))


def _mean(colour: Sequence[float]) -> float:
    """Return the mean of red, green and blue, which count alike: none of the three is to be noisy."""
    return sum(colour) / 3


def _times(colour: Color, factor: float) -> Color:
    r, g, b = (value * factor for value in colour)
    return r, g, b


def _rounded(colour: Color) -> Color:
    r, g, b = (float(f"{value:.{SHARE_DIGITS}g}") for value in colour)
    return r, g, b


def _divided(colour: Color, by: Color) -> Color:
    """Return the ratio of two colours, channel by channel; 0 if neither has light of that colour."""
    r, g, b = (value / divisor if divisor else 0.0 for value, divisor in zip(colour, by, strict=True))
    return r, g, b
