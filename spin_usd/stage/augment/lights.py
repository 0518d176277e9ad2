"""Parameters of lights: the Sun, which is the strongest distant light, and the fills, which are all others."""

from collections.abc import Callable, Iterator

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.stage.augment.attribute_change import (
    AttributeChange,
    BaseStage,
    ChangedAttribute,
    ParameterValues,
    attribute_of,
    moves_in_time,
)
from spin_usd.stage.augment.body_axes import cam_from_body
from spin_usd.stage.read.bodies.find_bodies import find_target
from spin_usd.stage.read.camera import find_camera
from spin_usd.stage.read.distant_light import read_distant_light
from spin_usd.stage.read.lights import find_lights
from spin_usd.stage.usd.conversion import quatd
from spin_usd.stage.usd.transforms import placement
from spin_usd.stage.usd.values import read

SAMPLED = ":sampled"
"""Suffix of the transform operations that are written here, so that they never collide with the stage's own."""
DIGITS = 9


def find_sun(base: BaseStage) -> Usd.Prim:
    """Find the strongest distant light that can be visible, at the first picture. Raises InputError where there is
    none."""
    world = UsdGeom.XformCache(base.first)
    suns = [prim for prim in find_lights(base.stage) if prim.IsA(UsdLux.DistantLight)]
    if not suns:
        found = "the stage has no distant light, and the Sun would be one"
        raise InputError(found, where=base.stage.GetRootLayer().GetDisplayName(), do="select lights that have one")
    still = Transform(to="cam", of="world", rotation=np.eye(3), translation=np.zeros(3))
    return max(suns, key=lambda prim: sum(read_distant_light(prim, base.first, still, world).irradiance))


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
    sun, camera = find_sun(base), find_camera(base.stage)
    moves = moves_in_time(camera) or moves_in_time(sun.GetParent())
    still = None if moves else _parent_from_cam(base, sun, camera, base.times[0])

    def direction(sampled: Float, time: float) -> Float:
        rotation = _parent_from_cam(base, sun, camera, time) if still is None else still
        return np.asarray(rotation @ sampled)

    return _turned_sun(sun, names, direction, moves)


def sun_from_target(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Rotate the Sun so that its own z axis has the sampled direction, body axes: it turns with the target."""
    sun, camera, target = find_sun(base), find_camera(base.stage), find_target(base.stage)
    moves = any(map(moves_in_time, (camera, target, sun.GetParent())))

    def direction(sampled: Float, time: float) -> Float:
        T_cam_body, _ = cam_from_body(base, target, camera, time)
        return np.asarray(_parent_from_cam(base, sun, camera, time) @ T_cam_body.directions(sampled))

    return _turned_sun(sun, names, direction, moves)


def _turned_sun(
    sun: Usd.Prim, names: tuple[str, ...], direction: Callable[[Float, float], Float], varies: bool
) -> AttributeChange:
    """Return the change of the Sun's rotation; `direction` gives that to it, in its parent's axes, for the sampled
    direction and a time code."""
    (name,) = names

    def values(sampled: ParameterValues, time: float) -> tuple[object, ...]:
        return (quatd(_rotation_of_z(direction(np.array(sampled[name]), time))),)

    orient = ChangedAttribute(prim=str(sun.GetPath()), name=f"xformOp:orient{SAMPLED}", type="quatd")
    return AttributeChange(
        parameters=names, attributes=(orient,), values=values, varies=varies, fixed=(order(sun, orient),)
    )


def order(prim: Usd.Prim, *operations: ChangedAttribute) -> tuple[ChangedAttribute, list[str]]:
    """Return the prim's new xformOpOrder; a prim that resets its transform stack still does."""
    reset = ["!resetXformStack!"] if UsdGeom.Xformable(prim).GetResetXformStack() else []
    at = ChangedAttribute(prim=str(prim.GetPath()), name="xformOpOrder", type="token[]", uniform=True)
    return at, [*reset, *(each.name for each in operations)]


def _parent_from_cam(base: BaseStage, prim: Usd.Prim, camera: Usd.Prim, time: float) -> Float:
    """Return the rotation (3, 3) from camera axes to those of the prim's parent."""
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    R_world_cam = camera_from_world(world, camera, base).rotation.T
    return parent_rotation(world, prim) @ R_world_cam


def parent_rotation(world: UsdGeom.XformCache, prim: Usd.Prim) -> Float:
    """Return the rotation (3, 3) from the world's axes to those in which the prim's own operations are."""
    if UsdGeom.Xformable(prim).GetResetXformStack():
        return np.eye(3)
    matrix = world.GetParentToWorldTransform(prim)
    return placement(matrix, frame="parent", metres=1.0, where=prim.GetPath().GetParentPath()).transform.rotation.T


def _rotation_of_z(direction: Float) -> Float:
    """Return the quaternion (4,) of the shortest rotation of the z axis to `direction` (3,), rounded: the same on every
    machine."""
    x, y, z = direction / np.linalg.norm(direction)
    q = np.array([1 + z, -y, x, 0.0]) if z > -1 + 1e-9 else np.array([0.0, 1, 0, 0])
    result: Float = np.round(q / np.linalg.norm(q), DIGITS) + 0.0
    return result


def strengths(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Set intensities: the Sun's irradiance, and factors on the Sun, on the fills, on all lights."""
    if "sun.irradiance" in names or "sun.factor" in names:
        sun: Usd.Prim | None = find_sun(base)
    else:
        suns = [prim for prim in find_lights(base.stage) if prim.IsA(UsdLux.DistantLight)]
        sun = find_sun(base) if suns else None
    lights = list(_changed_lights(base, sun, names))
    intensities = [UsdLux.LightAPI(prim).GetIntensityAttr() for prim in lights]
    varies = any(attribute.ValueMightBeTimeVarying() for attribute in intensities)
    per_watt = _intensity_per_watt(sun, base) if sun else 0.0
    constant = [float(read(attribute, base.first)) for attribute in intensities]

    def values(sampled: ParameterValues, time: float) -> tuple[float, ...]:
        own = [float(read(a, Usd.TimeCode(time))) for a in intensities] if varies else constant
        return tuple(_strength(own[i], sampled, prim == sun, per_watt) for i, prim in enumerate(lights))

    return AttributeChange(
        parameters=names, attributes=tuple(attribute_of(a) for a in intensities), values=values, varies=varies
    )


def _changed_lights(base: BaseStage, sun: Usd.Prim | None, names: tuple[str, ...]) -> Iterator[Usd.Prim]:
    """Yield the lights that the parameters change. Raises InputError where there is none."""
    lights = find_lights(base.stage)
    fills = [prim for prim in lights if prim != sun]
    if not lights or ("fill.factor" in names and not fills):
        found = f"the stage has no {'lights but the Sun' if lights else 'lights'}, so {names[0]} changes nothing"
        raise InputError(found, where=names[0], do="remove it, or select lights that have them")
    for prim in lights:
        own = ("sun.irradiance", "sun.factor") if prim == sun else ("fill.factor",)
        if {*own, "lights.factor"} & set(names):
            yield prim


def _intensity_per_watt(sun: Usd.Prim, base: BaseStage) -> float:
    """Return the intensity with which a white light gives 1 W/m2: see `stage.read.distant_light`."""
    light = UsdLux.LightAPI(sun)
    angle = float(read(sun.GetAttribute("inputs:angle"), base.first))
    size = 1.0 if angle == 0 else float(np.pi * np.sin(np.radians(angle) / 2) ** 2)
    scale = 1.0 if read(light.GetNormalizeAttr(), base.first) else 1 / size
    return float(scale / np.exp2(float(read(light.GetExposureAttr(), base.first))))


def _strength(own: float, sampled: ParameterValues, is_sun: bool, per_watt: float) -> float:
    if is_sun and "sun.irradiance" in sampled:
        own = float(sampled["sun.irradiance"]) * per_watt
    factor = sampled.get("sun.factor" if is_sun else "fill.factor", 1.0)
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
    """Return the lights that the parameter `name` changes, which its first word says."""
    if name.startswith("lights."):
        return list(find_lights(base.stage))
    sun = find_sun(base)
    return [sun] if name.startswith("sun.") else [prim for prim in find_lights(base.stage) if prim != sun]


def sun_angle(base: BaseStage, _: tuple[str, ...]) -> AttributeChange:
    """Set the Sun's apparent diameter; a normalised light keeps its irradiance."""
    at = attribute_of(find_sun(base).GetAttribute("inputs:angle"))
    return AttributeChange(
        parameters=("sun.angle",), attributes=(at,), values=lambda sampled, _: (float(sampled["sun.angle"]),)
    )
