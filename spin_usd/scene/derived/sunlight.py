"""The Sun of a scene: the brightest of its distant lights."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import DistantLight, Light
from spin_usd.scene.sensor import LUMINANCE


@dataclass(frozen=True, kw_only=True, eq=False)
class Sunlight:
    """Unit vectors (3,) towards the Sun in the camera's and in the target's axes, and the share of it that planets hide
    from the target."""

    towards_cam: Float
    towards_body: Float
    obscured: float


def sunlight(lights: Sequence[Light], T_cam_body: Transform) -> Sunlight | None:
    """Return the sunlight of the brightest distant light, behind a planet or not; None where no distant light
    shines."""
    sun = brightest(lights)
    if sun is None:
        return None
    towards = -np.array(sun.direction_cam) + 0.0  # no negative zeros
    body = T_cam_body.inverse().directions(towards) + 0.0
    return Sunlight(towards_cam=towards, towards_body=body, obscured=sun.obscuration)


def brightest(lights: Sequence[Light]) -> DistantLight | None:
    """Return the brightest distant light, behind a planet or not; None where none shines."""
    suns = [light for light in lights if isinstance(light, DistantLight)]
    sun = max(suns, key=_brightness, default=None)
    return sun if sun and _brightness(sun) else None


def phase_angle(towards_sun: Float, t_cam_body: Float) -> float:
    """Degrees between the Sun and the camera, seen from the target: 0 is full light."""
    away = t_cam_body / np.linalg.norm(t_cam_body)
    return float(np.degrees(np.arccos(np.clip(-towards_sun @ away, -1, 1))))


def _brightness(sun: DistantLight) -> float:
    return float(np.dot(LUMINANCE, sun.irradiance))
