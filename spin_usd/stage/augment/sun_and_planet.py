"""Positions of Sun, target and planet in all pictures, for constraints on sampled values."""

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.scene.sky import Sky
from spin_usd.stage.augment.attribute_change import BaseStage, moves_in_time
from spin_usd.stage.augment.body_axes import cam_from_body
from spin_usd.stage.augment.lights import find_sun, sun_directions
from spin_usd.stage.augment.planet import find_planet, planet_centres, radii
from spin_usd.stage.read.camera import find_camera, read_camera
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.read.target.bodies import find_target

RIM_STEPS = 16  # on each side of the picture


def read_sky(base: BaseStage) -> Sky:
    """Read the Sun, if any; the ball around the target's bound; the planet of earth.*, if any; the picture's rim."""
    suns = [prim for prim in find_lights(base.stage) if prim.IsA(UsdLux.DistantLight)]
    planet = find_planet(base)
    target, radius = _target(base)
    camera = read_camera(find_camera(base.stage), base.first)
    rays = camera.rays(camera.rim(RIM_STEPS))
    return Sky(
        sun=sun_directions(base, find_sun(base)) if suns else None,
        target=target,
        target_radius=radius,
        planet=planet_centres(base, planet) if planet else None,
        radii=radii(base, planet) if planet else (0.0, 0.0),
        frame=rays / np.linalg.norm(rays, axis=1, keepdims=True),
    )


def _target(base: BaseStage) -> tuple[Float, float]:
    """Return the middle (N, 3) of the target's bound, camera axes, and the radius of the ball around it, metres."""
    target, camera = find_target(base.stage), find_camera(base.stage)
    bound = UsdGeom.BBoxCache(base.first, [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    box = bound.ComputeUntransformedBound(target).ComputeAlignedRange()
    moves = moves_in_time(target) or moves_in_time(camera)
    middle = np.array(box.GetMidpoint()) * base.metres
    centres = [_centre(base, target, camera, time, middle) for time in (base.times if moves else base.times[:1])]
    return np.array(centres), float(box.GetSize().GetLength()) / 2 * base.metres


def _centre(base: BaseStage, target: Usd.Prim, camera: Usd.Prim, time: float, middle: Float) -> Float:
    T_cam_body, scale = cam_from_body(base, target, camera, time)
    return T_cam_body.points(middle * scale)
