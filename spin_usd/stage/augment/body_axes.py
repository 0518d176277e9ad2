"""The target's axes in the camera's, at the times of a base."""

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.stage.augment.attribute_change import BaseStage
from spin_usd.stage.read.bodies.find_bodies import find_target
from spin_usd.stage.read.camera import find_camera
from spin_usd.stage.usd.transforms import between, placement


def body_rotations(base: BaseStage) -> Float:
    """Return R_cam_body (N, 3, 3), one for each of the base's times."""
    target, camera = find_target(base.stage), find_camera(base.stage)
    return np.array([cam_from_body(base, target, camera, time)[0].rotation for time in base.times])


def cam_from_body(base: BaseStage, target: Usd.Prim, camera: Usd.Prim, time: float) -> tuple[Transform, float]:
    """Return T_cam_body, metres, and the scale of the body's axes in the world."""
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    usdcam, body = (
        placement(world.GetLocalToWorldTransform(prim), frame=frame, metres=base.metres, where=prim.GetPath())
        for prim, frame in ((camera, "usdcam"), (target, "body"))
    )
    return T_CAM_USDCAM @ between(usdcam.transform, body.transform), body.scale
