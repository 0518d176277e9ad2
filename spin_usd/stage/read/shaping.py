"""UsdLux.ShapingAPI: cone, softness, focus and tint."""

import numpy as np
from pxr import Usd

from spin_usd.errors import UnsupportedError
from spin_usd.scene.light import Shaping
from spin_usd.stage.usd.values import AT_LEAST_0, Range, value_in

CONE, SOFTNESS = "inputs:shaping:cone:angle", "inputs:shaping:cone:softness"
FOCUS, TINT = "inputs:shaping:focus", "inputs:shaping:focusTint"
SOFTNESSES = Range(0, 100)
FOCI = Range(-1e6, 1e6)  # the power of a cosine: a beam of a milliradian, the narrowest in float32
TINTS = Range(0, 1e6)


def read_shaping(prim: Usd.Prim, time: Usd.TimeCode) -> Shaping | None:
    """Read the shaping of the light at `prim`; None where it emits equally in all directions.

    An input counts where it exists, by the applied schema or by being authored, as in Hydra. The cone's angle is
    measured from the axis, -z. A focus below 0 is ignored, as the schema's text says.
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
