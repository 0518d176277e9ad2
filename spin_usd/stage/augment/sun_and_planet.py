"""Positions of Sun, target and planet in all pictures, for constraints on sampled values."""

from collections.abc import Sized
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.scene.environment import Sky
from spin_usd.stage.augment.attribute_change import BaseStage, moves_in_time
from spin_usd.stage.augment.body_axes import cam_from_body
from spin_usd.stage.augment.lights import find_sun, sun_directions
from spin_usd.stage.augment.planet import find_planet, planet_centres, radii
from spin_usd.stage.augment.sampled_values import SampledValues, write_values
from spin_usd.stage.augment.write_augmentations import MAX_FRAMES_IN_TEXT
from spin_usd.stage.author.added_layer import FOLDER, add_layer
from spin_usd.stage.author.paths import ENVIRONMENT, LIGHTS, WORLD
from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.read.bodies.find_bodies import find_target
from spin_usd.stage.read.camera import find_camera, read_camera
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.usd.layer_file import author_metadata, writing

RIM_STEPS = 16  # on each side of the picture
NAME = "sampled"


def read_sky(base: BaseStage) -> Sky:
    """Read the Sun, if any; the ball around the target's bound; the planet of earth.*, if any; the picture's rim."""
    planet = find_planet(base.stage)
    target, radius = _target(base)
    camera = read_camera(find_camera(base.stage), base.first)
    rays = camera.rays(camera.rim(RIM_STEPS))
    return Sky(
        sun=sun_directions(base, find_sun(base)) if has_sun(base.stage) else None,
        target=target,
        target_radius=radius,
        planet=planet_centres(base, planet) if planet else None,
        radii=radii(base, planet) if planet else (0.0, 0.0),
        frame=rays / np.linalg.norm(rays, axis=1, keepdims=True),
    )


def has_sun(stage: Usd.Stage) -> bool:
    """Return whether the stage has a distant light."""
    return any(prim.IsA(UsdLux.DistantLight) for prim in find_lights(stage))


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
    """Write `values` into the layers of lights and environment of the stage at `root`, which has `frames` pictures; all
    values of a prim with one that differs between pictures go beside those layers, as text if short enough to read.
    Opinions that they override are removed, so that a user edits what is rendered.

    The layers are referenced, so a variant on the default prim overrides them. Raises InputError for an attribute that
    is neither on the lights nor on the environment, OutputError.
    """
    places = (LIGHTS, ENVIRONMENT)
    changed = [Sdf.Path(each.attribute.prim) for each in values.attributes]
    if outside := next((path for path in changed if not any(map(path.HasPrefix, places))), None):
        raise InputError("is sampled, but belongs neither to the lights nor to the environment", where=outside)
    moving = {each.attribute.prim for each in values.attributes if each.samples}
    longest = max((len(each.value) for each in values.attributes if isinstance(each.value, Sized)), default=0)
    file = f"{NAME}{'.usdc' if max(frames, longest) > MAX_FRAMES_IN_TEXT and moving else '.usda'}"
    for place in places:
        _write_own(root.parent / FOLDER / f"{place.name.lower()}.usda", place, values, moving, file)
    if moving:
        layer = Sdf.Layer.CreateAnonymous(Path(file).suffix)
        documentation = f"The light of each picture. {values.credit}".strip()
        author_metadata(layer, default_prim=WORLD.name, frames=frames, documentation=documentation)
        write_values(layer, values.of(lambda prim: prim in moving))
        used = [place for place in places if any(Sdf.Path(prim).HasPrefix(place) for prim in moving)]
        add_layer(root, layer, file, {place: place for place in used})


def _write_own(path: Path, place: Sdf.Path, values: SampledValues, moving: set[str], file: str) -> None:
    """Write the values that hold for all pictures into the layer of `place`, and remove from it the opinions that those
    or `file` override. The layer's documentation lists them."""
    values = values.of(lambda prim: Sdf.Path(prim).HasPrefix(place))
    if not values.attributes:
        return
    layer, root = open_layer(path), Sdf.Path.absoluteRootPath.AppendChild(place.name)
    for each in values.attributes:
        prim = layer.GetPrimAtPath(Sdf.Path(each.attribute.prim).ReplacePrefix(place, root))
        named, unread = {spec.name: spec for spec in prim.attributes}, {each.attribute.name}
        if each.attribute.name == "xformOpOrder":
            unread |= {name for name in named if name.startswith("xformOp:")} - set(each.value)
        for name in unread & named.keys():
            prim.RemoveProperty(named[name])
        said = f"in {file} for each picture" if each.attribute.prim in moving else "as given to author, or drawn"
        if each.attribute.name != "xformOpOrder":  # the same as the operation
            layer.documentation += f"\n{prim.name} {each.attribute.name}: {said}."
    write_values(layer, values.of(lambda prim: prim not in moving), {str(place): str(root)})
    with writing(path):
        layer.Save()
