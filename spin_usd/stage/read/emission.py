"""The part that all lights share: emission, colour, shadows, shaping, and the refusal of unsupported
features.

The rules follow the normative text in UsdLux's schema (LightAPI, ShadowAPI, ShapingAPI; OpenUSD 25.05 and later) and of
the reference renderer hdEmbree: intensity times 2 ** exposure times colour times colour temperature, over the size.
"""

from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.light import Shaping
from spin_usd.scene.texture import Color
from spin_usd.stage.usd.shader_inputs import refuse_other_colours
from spin_usd.stage.usd.transforms import check_chain
from spin_usd.stage.usd.values import AT_LEAST_0, Range, read, read_all, value_in
from spin_usd.stage.usd.visibility import ancestors

NON_PHYSICAL = {"inputs:diffuse": 1.0, "inputs:specular": 1.0}
"""Inputs that are not physical, with the value at which they have no effect."""
EMISSIONS = Range(0, 1e15)  # the Sun's surface has 2e7 W/m2/sr, a laser 1e13; its products are finite in float32
TEMPERATURES = Range(1000, 10_000)  # UsdLux's; it clamps others silently
CONE, SOFTNESS = "inputs:shaping:cone:angle", "inputs:shaping:cone:softness"
FOCUS, TINT = "inputs:shaping:focus", "inputs:shaping:focusTint"
SOFTNESSES = Range(0, 100)
FOCI = Range(-1e6, 1e6)  # the power of a cosine: a beam of a milliradian, the narrowest in float32
TINTS = Range(0, 1e6)


def emission(prim: Usd.Prim, time: Usd.TimeCode, size: float) -> Color:
    """Compute the radiance, W/m2/sr (for a distant light the irradiance, W/m2), where normalisation divides by
    `size`."""
    light = UsdLux.LightAPI(prim)
    with np.errstate(over="ignore", invalid="ignore"):
        scale = read(light.GetIntensityAttr(), time) * np.exp2(np.float64(read(light.GetExposureAttr(), time)))
        rgb = scale / (size if read(light.GetNormalizeAttr(), time) else 1.0) * _color(light, time)
    r, g, b = (float(value) for value in rgb)
    if not all(value in EMISSIONS for value in (r, g, b)):
        do = f"choose an intensity, exposure and color that make it {EMISSIONS}"
        raise StageError(f"its emission is ({r:g}, {g:g}, {b:g})", where=prim.GetPath(), do=do)
    return r, g, b


def casts_shadows(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    """Read ShadowAPI's switch; without the schema lights cast shadows."""
    return read(prim.GetAttribute("inputs:shadow:enable"), time, Sdf.ValueTypeNames.Bool) is not False


def refuse_unsupported(prim: Usd.Prim) -> None:
    """Raise UnsupportedError for features of any light, at any time, that no renderer supports."""
    where = prim.GetPath()
    check_chain(prim)
    for above in ancestors(prim):
        if above.IsA(UsdGeom.PointInstancer):
            raise UnsupportedError("lies in a point instancer", where=where, do="move it out of there")
    if prim.GetRelationship("light:filters").GetTargets():
        raise UnsupportedError("has light filters", where=where, do="remove them")
    for attribute in prim.GetAuthoredAttributes():
        if attribute.GetName().startswith("inputs:") and attribute.HasAuthoredConnections():
            raise UnsupportedError(f"its {attribute.GetName()} is connected", where=where, do="give it a value")
    refuse_other_colours(prim.GetAttribute("inputs:color"), f"{where}.inputs:color")
    for name, value in NON_PHYSICAL.items():
        if _values(prim, name) - {value}:
            raise UnsupportedError(f"its {name} is not 1", where=where, do="scale its intensity instead")
    _check_shadow(prim)
    if any(path.path for path in _values(prim, "inputs:shaping:ies:file")):
        raise UnsupportedError("has an IES profile", where=where, do="shape it by cone and focus instead")


def _check_shadow(prim: Usd.Prim) -> None:
    """Raise UnsupportedError for shadows with a colour or a limited distance."""
    tinted = any(any(color) for color in _values(prim, "inputs:shadow:color"))
    ends = any(value >= 0 for name in ("distance", "falloff") for value in _values(prim, f"inputs:shadow:{name}"))
    if tinted or ends:
        found = f"its shadows {'have a colour' if tinted else 'end at a distance'}"
        raise UnsupportedError(
            found, where=prim.GetPath(), do="remove shadow:color, shadow:distance and shadow:falloff"
        )


def _values(prim: Usd.Prim, name: str) -> set[Any]:
    """Return all values that an attribute has at any time; an empty set without the attribute."""
    attribute = prim.GetAttribute(name)
    return set(read_all(attribute)) if attribute else set()


def _color(light: UsdLux.LightAPI, time: Usd.TimeCode) -> Float:
    color = np.array(read(light.GetColorAttr(), time), np.float64)
    if read(light.GetEnableColorTemperatureAttr(), time):
        kelvin = value_in(light.GetPrim(), "inputs:colorTemperature", TEMPERATURES, time)
        color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    return color


def read_shaping(prim: Usd.Prim, time: Usd.TimeCode) -> Shaping | None:
    """Read the shaping of the light at `prim`; None if it emits equally in all directions.

    An input counts if it exists, by the applied schema or as authored, as in Hydra. The cone's angle is measured from
    the axis, -z. A focus below 0 is ignored, as in the schema's text.
    """
    cone = value_in(prim, CONE, AT_LEAST_0, time) if prim.GetAttribute(CONE) else 180.0
    softness = value_in(prim, SOFTNESS, SOFTNESSES, time) if prim.GetAttribute(SOFTNESS) else 0.0
    focus = value_in(prim, FOCUS, FOCI, time) if prim.GetAttribute(FOCUS) else 0.0
    tint = value_in(prim, TINT, TINTS, time) if prim.GetAttribute(TINT) else (0.0, 0.0, 0.0)
    if (cone >= 180 and softness == 0) and focus <= 0:
        return None
    r, g, b = tint
    return Shaping(cone_angle=float(np.radians(cone)), softness=softness, focus=max(focus, 0.0), focus_tint=(r, g, b))


def refuse_shaping(prim: Usd.Prim, time: Usd.TimeCode, half_angle: float) -> None:
    """Raise UnsupportedError where a distant light or a dome is shaped. `half_angle`, radians: how far off its axis it
    emits light. A wider cone has no effect, nor has the applied schema alone."""
    if not any((a := prim.GetAttribute(name)) and a.HasAuthoredValue() for name in (CONE, SOFTNESS, FOCUS, TINT)):
        return
    shaping = read_shaping(prim, time)
    if shaping and (shaping.focus > 0 or shaping.cone_angle * (1 - shaping.softness) <= half_angle):
        found = f"is a {prim.GetTypeName()} with a cone or a focus"
        raise UnsupportedError(found, where=prim.GetPath(), do="remove ShapingAPI from it")
