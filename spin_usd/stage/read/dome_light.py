"""Light from all around: UsdLux.DomeLight and DomeLight_1.

Their images are latitude-longitude as OpenEXR defines it: the top row is the pole +y, the middle column +z, and +x lies
a quarter of the width left of that. DomeLight_1 may start with its pole along +z instead, the middle column along -y.
Normalisation does not apply to a dome. Source: UsdLux's schema text on DomeLight_1 and on LightAPI's normalize.
"""

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import UnsupportedError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import DomeLight
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.emission import casts_shadows, emission
from spin_usd.stage.read.light_texture import read_texture
from spin_usd.stage.read.shaping import refuse_shaping
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.transforms import placement
from spin_usd.stage.usd.values import read

MIDDLE_COLUMN = np.diag([-1.0, 1.0, -1.0])  # scene.light's dome has it along -z, USD's along +z
POLE_TO_Z = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # +y to +z, +z to -y


def is_dome(prim: Usd.Prim) -> bool:
    """Return whether the prim is a dome light."""
    return bool(prim.IsA(UsdLux.DomeLight) or prim.IsA(UsdLux.DomeLight_1))


def read_dome_light(prim: Usd.Prim, space: CameraSpace, images: Images) -> DomeLight:
    """Read the light, in camera axes. Raises StageError, UnsupportedError."""
    time = space.time
    refuse_shaping(prim, time, np.pi)
    if not casts_shadows(prim, time):
        raise UnsupportedError("is a dome without shadows", where=prim.GetPath(), do="enable its shadows")
    matrix = space.world.GetLocalToWorldTransform(prim)
    matrix.SetTranslateOnly((0, 0, 0))  # a dome is infinitely far
    T_world_usd = placement(matrix, frame="usd dome", metres=1.0, where=prim.GetPath()).transform
    T_usd_dome = Transform(to="usd dome", of="dome", rotation=_pole(prim) @ MIDDLE_COLUMN, translation=np.zeros(3))
    axes = space.T_cam_world @ T_world_usd @ T_usd_dome
    return DomeLight(
        path=str(prim.GetPath()),
        T_cam_dome=Transform(to="cam", of="dome", rotation=axes.rotation, translation=np.zeros(3)),
        radiance=emission(prim, time, 1.0),
        image=read_texture(prim, time, images),
    )


def _pole(prim: Usd.Prim) -> Float:
    """Return the rotation (3, 3) that takes the pole from +y to where DomeLight_1 starts."""
    axis = read(UsdLux.DomeLight_1(prim).GetPoleAxisAttr()) if prim.IsA(UsdLux.DomeLight_1) else "Y"
    axis = UsdGeom.GetStageUpAxis(prim.GetStage()) if axis == "scene" else axis
    return POLE_TO_Z if axis == "Z" else np.eye(3)
