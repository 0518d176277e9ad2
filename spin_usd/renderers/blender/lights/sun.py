"""Distant lights as Blender Suns. Energy is irradiance, W/m2: a white Lambertian that faces one has radiance E/pi."""

from typing import Any

import bpy
import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.renderers.blender.cycles.assign import assign
from spin_usd.renderers.blender.lights.placement import LightPlacement
from spin_usd.scene.light import DistantLight


class Sun:
    """One Blender Sun; `parent` is that of all lights."""

    def __init__(self, parent: Any) -> None:
        self._parent = parent
        self.object = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))

    def show(self, light: DistantLight) -> None:
        """Make it `light`."""
        energy = max(light.at_target)
        color = tuple(value / energy for value in light.at_target)
        assign(self.object.data, {"energy": energy, "color": color, "angle": light.angle})
        rotation = shining_along(T_USDCAM_CAM.directions(light.direction_cam))
        LightPlacement(rotation=rotation, location=np.zeros(3), parent=self._parent).move(self.object)

    def casts_shadows(self, shadows: bool) -> None:
        assign(self.object.data, {"use_shadow": shadows})

    def remove(self) -> None:
        bpy.data.lights.remove(self.object.data)  # and with it the object


def shining_along(direction: Float) -> Float:
    """Return a rotation matrix (3, 3) that takes -z, along which a Blender Sun shines, to the unit `direction`."""
    z = -np.asarray(direction, np.float64)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], -1)
