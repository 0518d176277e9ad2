"""Parameters of lights: the Sun, which is the strongest distant light, further Suns like it, and the fills, which are
all others.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.stage.augment.attribute_change import (
    AttributeChange,
    BaseStage,
    ChangedAttribute,
    CopiedPrim,
    ParameterValues,
    attribute_of,
    moves_in_time,
)
from spin_usd.stage.augment.body_axes import cam_from_body
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.read.bodies.find_bodies import find_target
from spin_usd.stage.read.camera import find_camera
from spin_usd.stage.read.distant_light import read_distant_light
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.usd.conversion import quatd
from spin_usd.stage.usd.transforms import SAMPLED, placement
from spin_usd.stage.usd.values import read

DIGITS = 9
MAX_SUNS = 8
SUNS = tuple(f"sun.{number}.direction" for number in range(2, MAX_SUNS + 1))
"""The parameters that add Suns."""
NUMBER = "spin:sun"
"""The custom data by which an added Sun is known: its number."""
SHINING = "sun.shining"
"""The parameter that chooses among them."""


def find_sun(base: BaseStage) -> Usd.Prim:
    """Find the strongest distant light that can be visible, at the first picture. Raises InputError if there is
    none."""
    world = UsdGeom.XformCache(base.first)
    distant = [prim for prim in find_lights(base.stage) if prim.IsA(UsdLux.DistantLight)]
    suns = [prim for prim in distant if not prim.HasCustomDataKey(NUMBER)]
    if not suns:
        found = "the stage has no distant light, and the Sun would be one"
        raise InputError(found, where=base.stage.GetRootLayer().GetDisplayName(), do="select lights that have one")
    still = Transform(to="cam", of="world", rotation=np.eye(3), translation=np.zeros(3))
    return max(suns, key=lambda prim: sum(read_distant_light(prim, base.first, still, world).irradiance))


def find_suns(base: BaseStage) -> dict[int, Usd.Prim]:
    """Find the Sun, number 1, and added Suns, by their numbers. Raises InputError."""
    added = [prim for prim in find_lights(base.stage) if prim.HasCustomDataKey(NUMBER)]
    return {1: find_sun(base)} | {int(prim.GetCustomDataByKey(NUMBER)): prim for prim in added}


def sun_directions(base: BaseStage, sun: Usd.Prim) -> Float:
    """Return unit vectors (N, 3) to the Sun as the stage has it, camera axes; (1, 3) where nothing moves."""
    camera = find_camera(base.stage)
    moves = moves_in_time(sun) or moves_in_time(camera)
    found = []
    for time in base.times if moves else base.times[:1]:
        world = UsdGeom.XformCache(Usd.TimeCode(time))
        T_cam_world = camera_from_world(world, camera, base)
        found.append(read_distant_light(sun, Usd.TimeCode(time), T_cam_world, world).direction_cam)
    return -np.array(found, np.float64)  # a light's own direction is where it travels to


def camera_from_world(world: UsdGeom.XformCache, camera: Usd.Prim, base: BaseStage) -> Transform:
    """T_cam_world, metres, at the time of `world`."""
    matrix = world.GetLocalToWorldTransform(camera)
    found = placement(matrix, frame="usdcam", metres=base.metres, where=camera.GetPath())
    return T_CAM_USDCAM @ found.transform.inverse()


def sun_direction(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Rotate the Sun so that its own z axis has the sampled direction, camera axes."""
    sun = find_sun(base)
    return _sun_towards(base, sun, str(sun.GetPath()), names)


def another_sun(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Add a Sun that is like the Sun in all but its direction, which is sampled, camera axes."""
    sun, number = find_sun(base), names[0].split(".")[1]
    path = f"{sun.GetPath()}_{number}"
    if base.stage.GetPrimAtPath(path):
        raise InputError(f"the stage has {path}", where=names[0], do="choose another number")
    change = _sun_towards(base, sun, path, names)
    layer = Sdf.Layer.CreateAnonymous()
    alike = stage_on(layer)
    prim = alike.DefinePrim(path, sun.GetTypeName())
    own = sun.GetPrimTypeInfo().GetAppliedAPISchemas()
    prim.SetMetadata("apiSchemas", Sdf.TokenListOp.Create(prependedItems=own))
    prim.SetCustomDataByKey(NUMBER, int(number))
    for each in sun.GetAuthoredProperties():
        if not each.GetName().startswith("xformOp"):
            each.FlattenTo(prim)
    return replace(change, copies=(CopiedPrim(path=path, of=str(sun.GetPath()), layer=layer),))


def _sun_towards(base: BaseStage, sun: Usd.Prim, path: str, names: tuple[str, ...]) -> AttributeChange:
    """Return the change that turns the prim at `path`, the Sun or one that is like it, to the sampled direction."""
    camera = find_camera(base.stage)
    moves = moves_in_time(camera) or moves_in_time(sun.GetParent())
    still = None if moves else _parent_from_cam(base, sun, camera, base.times[0])

    def direction(sampled: Float, time: float) -> Float:
        rotation = _parent_from_cam(base, sun, camera, time) if still is None else still
        return np.asarray(rotation @ sampled)

    return _turned_sun(sun, path, names, direction, moves)


def sun_from_target(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Rotate the Sun so that its own z axis has the sampled direction, body axes: it turns with the target."""
    sun, camera, target = find_sun(base), find_camera(base.stage), find_target(base.stage)
    moves = any(map(moves_in_time, (camera, target, sun.GetParent())))

    def direction(sampled: Float, time: float) -> Float:
        T_cam_body, _ = cam_from_body(base, target, camera, time)
        return np.asarray(_parent_from_cam(base, sun, camera, time) @ T_cam_body.directions(sampled))

    return _turned_sun(sun, str(sun.GetPath()), names, direction, moves)


def _turned_sun(
    sun: Usd.Prim, path: str, names: tuple[str, ...], direction: Callable[[Float, float], Float], varies: bool
) -> AttributeChange:
    """Return the change of the rotation of the prim at `path`, as in _sun_towards; `direction` gives that to it, in its
    parent's axes, for the sampled direction and a time code."""
    (name,) = names

    def values(sampled: ParameterValues, time: float) -> tuple[object, ...]:
        return (quatd(rotation_of_z(direction(np.array(sampled[name]), time))),)

    orient = ChangedAttribute(prim=path, name=f"xformOp:orient{SAMPLED}", type="quatd")
    return AttributeChange(
        parameters=names, attributes=(orient,), values=values, varies=varies, fixed=(order(sun, orient),)
    )


def order(prim: Usd.Prim, *operations: ChangedAttribute) -> tuple[ChangedAttribute, list[str]]:
    """Return the new xformOpOrder of the prim, or of one like it; one that resets its transform stack still does."""
    reset = ["!resetXformStack!"] if UsdGeom.Xformable(prim).GetResetXformStack() else []
    at = ChangedAttribute(prim=operations[0].prim, name="xformOpOrder", type="token[]", uniform=True)
    return at, [*reset, *(each.name for each in operations)]


def _parent_from_cam(base: BaseStage, prim: Usd.Prim, camera: Usd.Prim, time: float) -> Float:
    """Return the rotation (3, 3) from camera axes to the axes of the prim's parent."""
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    R_world_cam = camera_from_world(world, camera, base).rotation.T
    return parent_rotation(world, prim) @ R_world_cam


def parent_rotation(world: UsdGeom.XformCache, prim: Usd.Prim) -> Float:
    """Return the rotation (3, 3) from the world's axes to those in which the prim's own operations are."""
    if UsdGeom.Xformable(prim).GetResetXformStack():
        return np.eye(3)
    matrix = world.GetParentToWorldTransform(prim)
    return placement(matrix, frame="parent", metres=1.0, where=prim.GetPath().GetParentPath()).transform.rotation.T


def rotation_of_z(direction: Float, digits: int = DIGITS) -> Float:
    """Return the quaternion (4,) of the shortest rotation of the z axis to `direction` (3,), rounded: the same on every
    machine."""
    x, y, z = direction / np.linalg.norm(direction)
    q = np.array([1 + z, -y, x, 0.0]) if z > -1 + 1e-9 else np.array([0.0, 1, 0, 0])
    result: Float = np.round(q / np.linalg.norm(q), digits) + 0.0
    return result


def strengths(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Set intensities: the Suns' irradiance, factors on Suns, on the fills, on all lights, and which Sun shines."""
    distant = any(prim.IsA(UsdLux.DistantLight) for prim in find_lights(base.stage))
    suns = find_suns(base) if distant or any(name.startswith("sun.") for name in names) else {}
    for name in names:
        if (number := name.split(".")[1]).isdigit() and int(number) not in suns:
            do = f"draw it for pictures of an augmentation that has sun.{number}.direction"
            raise InputError(f"the stage has no Sun {number}", where=name, do=do)
    lights = _changed_lights(base, suns, names)
    intensities = [UsdLux.LightAPI(prim).GetIntensityAttr() for prim in lights]
    varies = any(attribute.ValueMightBeTimeVarying() for attribute in intensities)
    per_watt = _intensity_per_watt(suns[1], base) if suns else 0.0
    constant = [float(read(attribute, base.first)) for attribute in intensities]

    def values(sampled: ParameterValues, time: float) -> tuple[float, ...]:
        if sampled.get(SHINING, 1) not in {*suns, 1}:
            do = f"choose among {', '.join(map(str, sorted(suns)))}"
            raise InputError(f"the stage has no Sun {sampled[SHINING]:g}", where=SHINING, do=do)
        own = [float(read(a, Usd.TimeCode(time))) for a in intensities] if varies else constant
        return tuple(_strength(own[i], sampled, number, per_watt) for i, number in enumerate(lights.values()))

    return AttributeChange(
        parameters=names, attributes=tuple(attribute_of(a) for a in intensities), values=values, varies=varies
    )


def _changed_lights(base: BaseStage, suns: Mapping[int, Usd.Prim], names: tuple[str, ...]) -> dict[Usd.Prim, int]:
    """Return the lights that the parameters change, with the Suns' numbers and 0 for others. Raises InputError if there
    is none."""
    lights, numbers = find_lights(base.stage), {prim: number for number, prim in suns.items()}
    fills = [prim for prim in lights if prim not in numbers]
    if not lights or ("fill.factor" in names and not fills):
        name = "fill.factor" if lights else names[0]
        none = f"the stage has no {'lights but the Sun' if lights else 'lights'}, so {name} changes nothing"
        raise InputError(none, where=name, do="remove it, or select lights that have them")
    found: dict[Usd.Prim, int] = {}
    for prim in lights:
        number = numbers.get(prim, 0)
        own = ("sun.irradiance", "sun.factor", SHINING, f"sun.{number}.factor") if number else ("fill.factor",)
        if {*own, "lights.factor"} & set(names):
            found[prim] = number
    return found


def _intensity_per_watt(sun: Usd.Prim, base: BaseStage) -> float:
    """Return the intensity with which a white light gives 1 W/m2: see `stage.read.distant_light`."""
    light = UsdLux.LightAPI(sun)
    angle = float(read(sun.GetAttribute("inputs:angle"), base.first))
    size = 1.0 if angle == 0 else float(np.pi * np.sin(np.radians(angle) / 2) ** 2)
    scale = 1.0 if read(light.GetNormalizeAttr(), base.first) else 1 / size
    return float(scale / np.exp2(float(read(light.GetExposureAttr(), base.first))))


def _strength(own: float, sampled: ParameterValues, number: int, per_watt: float) -> float:
    """Return a light's intensity; `number`: a Sun's number, else 0."""
    if number and "sun.irradiance" in sampled:
        own = float(sampled["sun.irradiance"]) * per_watt
    factor = sampled.get("sun.factor" if number else "fill.factor", 1.0) * sampled.get(f"sun.{number}.factor", 1.0)
    factor *= sampled.get(SHINING, number) == number or not number
    return float(own * factor * sampled.get("lights.factor", 1.0))


def temperature(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Set and enable the colour temperature of the Sun, of all fills, or of all lights."""
    (name,) = names
    lights = _of_kind(base, name)
    if not lights:
        raise InputError("the stage has no such lights", where=name, do="remove it, or select lights that have them")
    apis = [UsdLux.LightAPI(prim) for prim in lights]
    return AttributeChange(
        parameters=names,
        attributes=tuple(attribute_of(light.GetColorTemperatureAttr()) for light in apis),
        values=lambda sampled, _: (float(sampled[name]),) * len(lights),
        fixed=tuple((attribute_of(light.GetEnableColorTemperatureAttr()), True) for light in apis),
    )


def _of_kind(base: BaseStage, name: str) -> list[Usd.Prim]:
    """Return the lights that the parameter `name` changes, from its first word."""
    if name.startswith("lights."):
        return list(find_lights(base.stage))
    suns = list(find_suns(base).values())
    return suns if name.startswith("sun.") else [prim for prim in find_lights(base.stage) if prim not in suns]


def sun_angle(base: BaseStage, _: tuple[str, ...]) -> AttributeChange:
    """Set the Sun's apparent diameter; a normalised light keeps its irradiance."""
    at = attribute_of(find_sun(base).GetAttribute("inputs:angle"))
    return AttributeChange(
        parameters=("sun.angle",), attributes=(at,), values=lambda sampled, _: (float(sampled["sun.angle"]),)
    )
