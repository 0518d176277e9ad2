"""Suns: UsdLux.DistantLight as irradiance and a direction.

Normalised, intensity is the irradiance on a plane that faces the light; else it is radiance, times pi sin^2(angle / 2),
or times 1 for an angle of 0. Source: UsdLux's schema text on LightAPI's normalize, "DistantLight".
"""

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import DistantLight
from spin_usd.stage.read.emission import casts_shadows, emission, refuse_shaping
from spin_usd.stage.usd.values import Range, value_in

ANGLES = Range(0, 180)  # degrees


def read_distant_light(
    prim: Usd.Prim, time: Usd.TimeCode, T_cam_world: Transform, world: UsdGeom.XformCache
) -> DistantLight:
    """Read the light at `time`, in camera axes. Raises StageError, UnsupportedError."""
    angle = value_in(prim, "inputs:angle", ANGLES, time)
    half = float(np.radians(angle)) / 2
    refuse_shaping(prim, time, half)
    size = 1.0 if angle == 0 else float(np.pi * np.sin(half) ** 2)
    r, g, b = (value * size for value in emission(prim, time, size))
    return DistantLight(
        path=str(prim.GetPath()),
        direction_cam=direction_cam(prim, T_cam_world, world),
        irradiance=(r, g, b),
        angle=2 * half,
        shadows=casts_shadows(prim, time),
    )


def direction_cam(prim: Usd.Prim, T_cam_world: Transform, world: UsdGeom.XformCache) -> tuple[float, float, float]:
    """Return the unit vector, in camera axes, along which the light shines at the time of `world`."""
    x, y, z = T_cam_world.directions(_direction(prim, world)).tolist()
    return x, y, z


def _direction(prim: Usd.Prim, world: UsdGeom.XformCache) -> Float:
    """Return the unit vector (3,) along which the light shines: its own -z."""
    to = -np.array(world.GetLocalToWorldTransform(prim))[2, :3]
    length = np.linalg.norm(to)
    if not np.isfinite(length) or length == 0:
        raise StageError("its transform gives it no direction", where=prim.GetPath(), do="fix its xformOps")
    result: Float = to / length
    return result
