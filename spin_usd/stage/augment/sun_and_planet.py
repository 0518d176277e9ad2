"""Positions of Sun, target and planet in all pictures, for constraints on sampled values."""

from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.scene.environment import Sky
from spin_usd.stage.augment.attribute_change import BaseStage, moves_in_time
from spin_usd.stage.augment.body_axes import cam_from_body
from spin_usd.stage.augment.lights import find_sun, sun_directions
from spin_usd.stage.augment.planet import find_planet, planet_centres, radii
from spin_usd.stage.augment.sampled_values import SampledValues, write_values
from spin_usd.stage.augment.write_augmentations import MAX_FRAMES_IN_TEXT
from spin_usd.stage.author.added_layer import add_layer
from spin_usd.stage.author.paths import ENVIRONMENT, LIGHTS, WORLD
from spin_usd.stage.read.camera import find_camera, read_camera
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.read.target.bodies import find_target
from spin_usd.stage.usd.layer_file import author_metadata

RIM_STEPS = 16  # on each side of the picture
NAME = "sampled"


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


def write_sampled(root: Path, values: SampledValues, frames: int) -> None:
    """Write `values` beside the layers of the stage at `root`, which has `frames` pictures: as text where a person
    would read it.

    The layer is referenced, so a variant on the default prim beats it. Raises InputError for an attribute that is
    neither on the lights nor on the environment, OutputError.
    """
    places = (LIGHTS, ENVIRONMENT)
    changed = [Sdf.Path(each.attribute.prim) for each in values.attributes]
    if outside := next((path for path in changed if not any(map(path.HasPrefix, places))), None):
        raise InputError("is sampled, but belongs neither to the lights nor to the environment", where=outside)
    suffix = ".usdc" if frames > MAX_FRAMES_IN_TEXT and any(each.samples for each in values.attributes) else ".usda"
    layer = Sdf.Layer.CreateAnonymous(suffix)
    author_metadata(
        layer, default_prim=WORLD.name, frames=frames, documentation="The light drawn or given for each picture."
    )
    write_values(layer, values)
    used = [place for place in places if any(path.HasPrefix(place) for path in changed)]
    add_layer(root, layer, f"{NAME}{suffix}", {place: place for place in used})
