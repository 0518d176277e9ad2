"""Distant lights as Blender Suns. Energy is irradiance, W/m2: a white Lambertian that faces one has radiance E/pi."""

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]

from spin_usd.arrays import Float
from spin_usd.errors import UnsupportedError
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.render.blender.settings import assign
from spin_usd.scene.light import DistantLight

MAX_ANGLE = 3.0  # radians; Blender clamps a little above


class SunRig:
    """As many Suns as one Blender scene's lights need."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._suns: list[Any] = []

    def shine(self, lights: Sequence[DistantLight]) -> None:
        """Make the scene's lights these."""
        for light in lights:
            check_light(light)
        shining = [light for light in lights if any(light.irradiance)]
        while len(self._suns) < len(shining):
            self._suns.append(self._new_sun())
        while len(self._suns) > len(shining):
            bpy.data.lights.remove(self._suns.pop().data)  # and with it the object
        for sun, light in zip(self._suns, shining, strict=True):
            self._set(sun, light)

    def _new_sun(self) -> Any:
        data = bpy.data.lights.new("sun", "SUN")
        sun = bpy.data.objects.new("sun", data)
        self._scene.collection.objects.link(sun)
        return sun

    def _set(self, sun: Any, light: DistantLight) -> None:
        energy = max(light.irradiance)
        color = tuple(value / energy for value in light.irradiance)
        assign(sun.data, {"energy": energy, "color": color, "angle": light.angle})
        rotation = np.eye(4)
        rotation[:3, :3] = shining_along(T_USDCAM_CAM.directions(light.direction_cam))
        sun.matrix_world = Matrix(rotation)


def shining_along(direction: Float) -> Float:
    """A rotation matrix (3, 3) that takes -z, along which a Blender Sun shines, to the unit `direction`."""
    z = -np.asarray(direction, np.float64)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], -1)


def check_light(light: DistantLight) -> None:
    """Raise UnsupportedError, with the light's path, for what a Sun cannot be."""
    if not np.isfinite(light.irradiance).all() or min(light.irradiance) < 0:
        raise UnsupportedError(f"irradiance {light.irradiance} is not finite and positive", where=light.path)
    if not 0 <= light.angle <= MAX_ANGLE:
        raise UnsupportedError(f"angle is {light.angle} rad, expected 0 to {MAX_ANGLE}", where=light.path)
    if abs(float(np.linalg.norm(light.direction_cam)) - 1) > 1e-6:
        raise UnsupportedError(f"direction {light.direction_cam} is not of unit length", where=light.path)
