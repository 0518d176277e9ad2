"""Distant lights as Blender Suns. Energy is irradiance, W/m2: a white Lambertian that faces one has radiance E/pi."""

import bpy
import numpy as np
from mathutils import Matrix  # type: ignore[import-not-found]

from spin_usd.arrays import Float
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.render.blender.settings import assign
from spin_usd.scene.light import DistantLight


class Sun:
    """One Blender Sun."""

    def __init__(self) -> None:
        self.object = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))

    def show(self, light: DistantLight) -> None:
        """Make it `light`."""
        energy = max(light.irradiance)
        color = tuple(value / energy for value in light.irradiance)
        assign(self.object.data, {"energy": energy, "color": color, "angle": light.angle})
        rotation = np.eye(4)
        rotation[:3, :3] = shining_along(T_USDCAM_CAM.directions(light.direction_cam))
        self.object.matrix_world = Matrix(rotation)

    def casts_shadows(self, shadows: bool) -> None:
        assign(self.object.data, {"use_shadow": shadows})

    def remove(self) -> None:
        bpy.data.lights.remove(self.object.data)  # and with it the object


def shining_along(direction: Float) -> Float:
    """A rotation matrix (3, 3) that takes -z, along which a Blender Sun shines, to the unit `direction`."""
    z = -np.asarray(direction, np.float64)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], -1)
