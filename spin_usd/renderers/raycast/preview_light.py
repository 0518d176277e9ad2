"""Lights of the preview: irradiance that arrives from one direction, or from all around alike.

A distant light is itself without its angular size. An area light is a point at its centre that has the radiant
intensity of the whole, by the projected area that its shape shows; a source never gives more than pi times its
radiance. A dome is its mean radiance.
"""

from dataclasses import dataclass

import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import AreaLight, DistantLight, DomeLight, PointLight, RectLight, Shaping

TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, kw_only=True, eq=False)
class Beam:
    """Light at N points. to_light: (3,) or (N, 3) unit, body axes · irradiance: (3,) or (N, 3) W/m2 of a plane that
    faces it · distance: (N,) metres to the light, None where it is far."""

    to_light: Float
    irradiance: Float
    distance: Float | None = None


def beam(light: DistantLight | AreaLight, T_cam_body: Transform, body: Float) -> Beam:
    """Return the light that arrives at the `body` points (N, 3)."""
    T_body_cam = T_cam_body.inverse()
    if isinstance(light, DistantLight):
        return Beam(to_light=-T_body_cam.directions(light.direction_cam), irradiance=np.array(light.at_target))
    away = T_body_cam.points(light.T_cam_light.translation) - body
    distance = np.maximum(np.linalg.norm(away, axis=1), np.sqrt(TINY))
    to_light = away / distance[:, None]
    leaving = -T_cam_body.directions(to_light) @ light.T_cam_light.rotation
    solid_angle = light.projected_area(leaving) / distance**2
    if not isinstance(light, PointLight):
        solid_angle = np.minimum(solid_angle, np.pi)
    emission = _shaped(light.shaping, -leaving[:, 2]) * light.emission
    if isinstance(light, RectLight) and light.image is not None:
        emission = emission * light.image.pixels[..., :3].mean((0, 1), dtype=np.float64)
    return Beam(to_light=to_light, irradiance=solid_angle[:, None] * emission, distance=distance)


def mean_radiance(dome: DomeLight) -> Float:
    """Return (3,) mean over all directions, W/m2/sr; an image's rows weigh as much as their belts of the sphere."""
    radiance = np.array(dome.radiance)
    if dome.image is None:
        return radiance
    rows = dome.image.pixels[..., :3].mean(1, dtype=np.float64)
    weights = np.sin((np.arange(len(rows)) + 0.5) * np.pi / len(rows))
    return np.asarray(radiance * (weights @ rows) / weights.sum())


def _shaped(shaping: Shaping | None, cosine: Float) -> Float:
    """Return (N, 3) factor of the emission at `cosine` (N,) from the axis."""
    if shaping is None:
        return np.ones((len(cosine), 3))
    angle = np.arccos(np.clip(cosine, -1, 1))
    soft = np.clip((shaping.cone_angle - angle) / max(shaping.cone_angle * shaping.softness, TINY), 0, 1)
    cone = soft**2 * (3 - 2 * soft) if shaping.softness > 0 else (angle < shaping.cone_angle).astype(float)
    tint = np.array(shaping.focus_tint)
    focus = np.abs(cosine[:, None]) ** shaping.focus
    return np.asarray(cone[:, None] * (tint + focus * (1 - tint)))
