"""displayColor and displayOpacity: the material of a gprim that is bound to none."""

from typing import Any

from pxr import Usd

from spin_usd.scene.material import LIMITS, Limits
from spin_usd.stage.read.materials.texture_nodes import PrimvarInput
from spin_usd.stage.read.shapes.primvars import find_primvar
from spin_usd.stage.usd.notes import Notes
from spin_usd.stage.usd.values import refuse_outside

DISPLAYED = {"displayColor": "diffuse_color", "displayOpacity": "opacity"}


def read_display_color(prim: Usd.Prim, time: Usd.TimeCode, notes: Notes) -> dict[str, Any]:
    """Read fields of Material, with PrimvarInput where they vary over `prim`; none where nothing is authored. Colours
    above 1 are clamped, because they would reflect more light than there is, and noted.

    Raises StageError for numbers that are not valid as a colour or an opacity.
    """
    fields: dict[str, Any] = {}
    for name, of in DISPLAYED.items():
        size = LIMITS[of].size
        primvar = find_primvar(prim, name, size, time)
        if primvar is None:
            continue
        if primvar.clamped:
            notes.add("color-clamped", primvar.where, "holds numbers above 1, which are rendered as 1")
        refuse_outside(primvar.values, Limits(name=name, size=size), primvar.where)
        first = tuple(float(v) for v in primvar.values[0])
        fields[of] = (
            PrimvarInput(name=name, fallback=first) if not primvar.is_constant else first if size > 1 else first[0]
        )
    return fields
