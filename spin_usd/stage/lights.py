"""Suns: UsdLux.DistantLight as irradiance and a direction. Every other light is refused by name."""

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import DistantLight
from spin_usd.stage.drawn import PROXIES, ancestors, is_always_invisible
from spin_usd.stage.xforms import check_chain


def find_lights(stage: Usd.Stage) -> tuple[Usd.Prim, ...]:
    """All lights of the stage, visible or not. Raises UnsupportedError for kinds other than DistantLight."""
    found = []
    for prim in Usd.PrimRange.Stage(stage, PROXIES):
        if not prim.HasAPI(UsdLux.LightAPI):
            continue
        if prim.IsA(UsdLux.DistantLight):
            _check_light(prim)
            found.append(prim)
        elif not any(is_always_invisible(p) for p in (*ancestors(prim), prim)):
            found_kind = f"is a {prim.GetTypeName()}, and only DistantLight is rendered yet"
            raise UnsupportedError(found_kind, where=prim.GetPath(), do="replace it, or make it invisible or inactive")
    return tuple(found)


def read_light(
    prim: Usd.Prim, time: Usd.TimeCode, T_cam_world: Transform, world: UsdGeom.XformCache
) -> DistantLight | None:
    """The light at `time`, in camera axes; None while it is invisible.

    UsdLux: normalised, intensity is the irradiance on a plane that faces the light; else it is radiance, times
    pi sin^2(angle / 2), or times 1 for an angle of 0. Source: UsdLux, "Normalizing Distant Lights - In Depth".
    """
    if UsdGeom.Imageable(prim).ComputeVisibility(time) == UsdGeom.Tokens.invisible:
        return None
    light, angle = UsdLux.LightAPI(prim), float(UsdLux.DistantLight(prim).GetAngleAttr().Get(time))
    if not 0 <= angle <= 180:
        raise UnsupportedError(f"its angle is {angle:g} degrees", where=prim.GetPath(), do="keep it between 0 and 180")
    half = np.radians(angle) / 2
    size = 1.0 if light.GetNormalizeAttr().Get(time) or angle == 0 else np.pi * np.sin(half) ** 2
    emission = light.GetIntensityAttr().Get(time) * 2.0 ** light.GetExposureAttr().Get(time)
    irradiance = emission * size * _color(light, time)
    if not np.isfinite(irradiance).all() or (irradiance < 0).any():
        raise StageError(f"its irradiance is {irradiance}", where=prim.GetPath(), do="make it finite and not negative")
    x, y, z = T_cam_world.directions(_direction(prim, world))
    r, g, b = (float(v) for v in irradiance)
    return DistantLight(
        path=str(prim.GetPath()),
        direction_cam=(float(x), float(y), float(z)),
        irradiance=(r, g, b),
        angle=float(2 * half),
    )


def _direction(prim: Usd.Prim, world: UsdGeom.XformCache) -> Float:
    """Unit (3,): a light shines along its own -z."""
    to = -np.array(world.GetLocalToWorldTransform(prim))[2, :3]
    length = np.linalg.norm(to)
    if not np.isfinite(length) or length == 0:
        raise StageError("its transform gives it no direction", where=prim.GetPath(), do="mend its xformOps")
    result: Float = to / length
    return result


def _color(light: UsdLux.LightAPI, time: Usd.TimeCode) -> Float:
    color = np.array(light.GetColorAttr().Get(time), np.float64)
    if light.GetEnableColorTemperatureAttr().Get(time):
        color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(light.GetColorTemperatureAttr().Get(time)))
    return color


def _check_light(prim: Usd.Prim) -> None:
    """Refuse what a DistantLight can ask for and a Sun cannot do."""
    check_chain(prim)
    light, where = UsdLux.LightAPI(prim), prim.GetPath()
    if prim.GetRelationship("light:filters").GetTargets():
        raise UnsupportedError("has light filters", where=where, do="remove them")
    for name in ("inputs:diffuse", "inputs:specular"):
        if prim.GetAttribute(name).Get() != 1:
            raise UnsupportedError(f"its {name} is not 1", where=where, do="scale its intensity instead")
    for collection in (light.GetLightLinkCollectionAPI(), light.GetShadowLinkCollectionAPI()):
        named = collection.GetIncludesRel().GetTargets() or collection.GetExcludesRel().GetTargets()
        if named or not collection.GetIncludeRootAttr().Get():
            raise UnsupportedError(f"is linked by {collection.GetName()}", where=where, do="let it light everything")
    shadow = prim.GetAttribute("inputs:shadow:enable")
    if shadow and shadow.Get() is False:
        raise UnsupportedError("casts no shadows", where=where, do="enable them")
