"""Settings of lights: the Sun, which is the strongest distant light, and the fills, which are all others."""

from collections.abc import Iterator

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.geometry.transform import Transform
from spin_usd.stage.augment.attribute_change import Base, Place, Setting, Values, place_of, placed_in_time
from spin_usd.stage.read.camera.camera import find_camera
from spin_usd.stage.read.lights.distant import read_distant_light
from spin_usd.stage.read.lights.lights import find_lights
from spin_usd.stage.usd.conversion import quatd
from spin_usd.stage.usd.transforms import placement

STRENGTHS = ("sun.irradiance", "sun.factor", "fill.factor", "lights.factor")
SAMPLED = ":sampled"
"""Suffix of the transform operations that are written here, so that none of the stage's own is met."""
DIGITS = 9


def find_sun(base: Base) -> Usd.Prim:
    """The strongest distant light that can be visible, at the first picture. Raises InputError where there is none."""
    world = UsdGeom.XformCache(base.first)
    suns = [prim for prim in find_lights(base.stage) if prim.IsA(UsdLux.DistantLight)]
    if not suns:
        found = "the stage has no distant light, so nothing is the Sun"
        raise InputError(found, where=base.stage.GetRootLayer().GetDisplayName(), do="select lights that have one")
    still = Transform(to="cam", of="world", rotation=np.eye(3), translation=np.zeros(3))
    return max(suns, key=lambda prim: sum(read_distant_light(prim, base.first, still, world).irradiance))


def sun_directions(base: Base, sun: Usd.Prim) -> Float:
    """(N, 3) or (1, 3) unit vectors to the Sun as the stage has it, camera axes."""
    camera = find_camera(base.stage)
    moves = placed_in_time(sun) or placed_in_time(camera)
    found = []
    for time in base.times if moves else base.times[:1]:
        world = UsdGeom.XformCache(Usd.TimeCode(time))
        T_cam_world = camera_from_world(world, camera, base)
        found.append(read_distant_light(sun, Usd.TimeCode(time), T_cam_world, world).direction_cam)
    return -np.array(found, np.float64)  # a light's own direction is where it travels to


def camera_from_world(world: UsdGeom.XformCache, camera: Usd.Prim, base: Base) -> Transform:
    """T_cam_world, metres, at the time of `world`."""
    matrix = world.GetLocalToWorldTransform(camera)
    found = placement(matrix, frame="usdcam", metres=base.metres, where=camera.GetPath())
    return T_CAM_USDCAM @ found.transform.inverse()


def sun_direction(base: Base, _: tuple[str, ...]) -> Setting:
    """Turns the Sun's own z axis to the direction drawn."""
    sun, camera = find_sun(base), find_camera(base.stage)
    moves = placed_in_time(camera) or placed_in_time(sun.GetParent())
    still = None if moves else _parent_from_cam(base, sun, camera, base.times[0])

    def values(drawn: Values, time: float) -> tuple[object, ...]:
        turn = _parent_from_cam(base, sun, camera, time) if still is None else still
        return (quatd(_turned_z(turn @ np.array(drawn["sun.direction"]))),)

    orient = Place(prim=str(sun.GetPath()), attribute=f"xformOp:orient{SAMPLED}", type="quatd")
    return Setting(
        parameters=("sun.direction",), places=(orient,), values=values, varies=moves, fixed=(order(sun, orient),)
    )


def order(prim: Usd.Prim, *operations: Place) -> tuple[Place, list[str]]:
    """The prim's operations, instead of those it has; what it resets stays reset."""
    reset = ["!resetXformStack!"] if UsdGeom.Xformable(prim).GetResetXformStack() else []
    at = Place(prim=str(prim.GetPath()), attribute="xformOpOrder", type="token[]", uniform=True)
    return at, [*reset, *(place.attribute for place in operations)]


def _parent_from_cam(base: Base, prim: Usd.Prim, camera: Usd.Prim, time: float) -> Float:
    """(3, 3) from camera axes to those of the prim's parent."""
    world = UsdGeom.XformCache(Usd.TimeCode(time))
    R_world_cam = camera_from_world(world, camera, base).rotation.T
    return parent_rotation(world, prim) @ R_world_cam


def parent_rotation(world: UsdGeom.XformCache, prim: Usd.Prim) -> Float:
    """(3, 3) from the world's axes to those in which the prim's own operations are."""
    if UsdGeom.Xformable(prim).GetResetXformStack():
        return np.eye(3)
    matrix = world.GetParentToWorldTransform(prim)
    return placement(matrix, frame="parent", metres=1.0, where=prim.GetPath().GetParentPath()).transform.rotation.T


def _turned_z(direction: Float) -> Float:
    """(4,) the shortest turn of the z axis to `direction` (3,), rounded: the same on every machine."""
    x, y, z = direction / np.linalg.norm(direction)
    q = np.array([1 + z, -y, x, 0.0]) if z > -1 + 1e-9 else np.array([0.0, 1, 0, 0])
    result: Float = np.round(q / np.linalg.norm(q), DIGITS) + 0.0
    return result


def strengths(base: Base, names: tuple[str, ...]) -> Setting:
    """Intensities: the Sun's irradiance, and factors on it, on the fills, on all."""
    if "sun.irradiance" in names or "sun.factor" in names:
        sun: Usd.Prim | None = find_sun(base)
    else:
        suns = [prim for prim in find_lights(base.stage) if prim.IsA(UsdLux.DistantLight)]
        sun = find_sun(base) if suns else None
    lights = list(_moved(base, sun, names))
    intensities = [UsdLux.LightAPI(prim).GetIntensityAttr() for prim in lights]
    varies = any(attribute.ValueMightBeTimeVarying() for attribute in intensities)
    per_watt = _intensity_per_watt(sun, base) if sun else 0.0
    constant = [float(attribute.Get(base.first)) for attribute in intensities]

    def values(drawn: Values, time: float) -> tuple[float, ...]:
        own = [float(a.Get(Usd.TimeCode(time))) for a in intensities] if varies else constant
        return tuple(_strength(own[i], drawn, prim == sun, per_watt) for i, prim in enumerate(lights))

    return Setting(parameters=names, places=tuple(place_of(a) for a in intensities), values=values, varies=varies)


def _moved(base: Base, sun: Usd.Prim | None, names: tuple[str, ...]) -> Iterator[Usd.Prim]:
    """The lights that the parameters change. Raises InputError where there is none."""
    lights = find_lights(base.stage)
    fills = [prim for prim in lights if prim != sun]
    if not lights or ("fill.factor" in names and not fills):
        found = f"the stage has no {'lights but the Sun' if lights else 'lights'}, so {names[0]} changes nothing"
        raise InputError(found, where=names[0], do="leave it out, or select lights that have them")
    for prim in lights:
        own = ("sun.irradiance", "sun.factor") if prim == sun else ("fill.factor",)
        if {*own, "lights.factor"} & set(names):
            yield prim


def _intensity_per_watt(sun: Usd.Prim, base: Base) -> float:
    """The intensity that is an irradiance of 1 W/m2, of a white light: see `distant_light`."""
    light = UsdLux.LightAPI(sun)
    angle = float(sun.GetAttribute("inputs:angle").Get(base.first))
    size = 1.0 if angle == 0 else float(np.pi * np.sin(np.radians(angle) / 2) ** 2)
    scale = 1.0 if light.GetNormalizeAttr().Get(base.first) else 1 / size
    return float(scale / np.exp2(float(light.GetExposureAttr().Get(base.first))))


def _strength(own: float, drawn: Values, is_sun: bool, per_watt: float) -> float:
    if is_sun and "sun.irradiance" in drawn:
        own = float(drawn["sun.irradiance"]) * per_watt
    factor = drawn.get("sun.factor" if is_sun else "fill.factor", 1.0)
    return float(own * factor * drawn.get("lights.factor", 1.0))


def temperature(base: Base, names: tuple[str, ...]) -> Setting:
    """The colour temperature of the Sun, of all fills, or of all lights; it counts from then on."""
    (name,) = names
    lights = _of_kind(base, name)
    if not lights:
        raise InputError("the stage has no such lights", where=name, do="leave it out, or select lights that have them")
    apis = [UsdLux.LightAPI(prim) for prim in lights]
    return Setting(
        parameters=names,
        places=tuple(place_of(light.GetColorTemperatureAttr()) for light in apis),
        values=lambda drawn, _: (float(drawn[name]),) * len(lights),
        fixed=tuple((place_of(light.GetEnableColorTemperatureAttr()), True) for light in apis),
    )


def _of_kind(base: Base, name: str) -> list[Usd.Prim]:
    """The lights that `name` is about, by its first word."""
    if name.startswith("lights."):
        return list(find_lights(base.stage))
    sun = find_sun(base)
    return [sun] if name.startswith("sun.") else [prim for prim in find_lights(base.stage) if prim != sun]


def sun_angle(base: Base, _: tuple[str, ...]) -> Setting:
    """The Sun's apparent diameter; a normalised light keeps its irradiance."""
    at = place_of(find_sun(base).GetAttribute("inputs:angle"))
    return Setting(parameters=("sun.angle",), places=(at,), values=lambda drawn, _: (float(drawn["sun.angle"]),))
