"""UsdPreviewSurface constants, as bound to prims."""

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Color

FALLBACK = Material(path="")
"""What USD shows where neither material nor displayColor says anything: 18 % grey."""

COLORS = {"diffuseColor": "diffuse_color", "emissiveColor": "emissive_color", "specularColor": "specular_color"}
FRACTIONS = {
    "metallic": "metallic",
    "roughness": "roughness",
    "clearcoat": "clearcoat",
    "clearcoatRoughness": "clearcoat_roughness",
    "opacity": "opacity",
}
NEUTRAL: dict[str, Any] = {"displacement": 0.0, "normal": (0.0, 0.0, 1.0)}
LINEAR = ("", "lin_rec709_scene", "lin_rec709", "raw", "data", "identity")


def bound_material(prim: Usd.Prim, time: Usd.TimeCode) -> Material:
    """What `prim` (a gprim or a GeomSubset) is made of: its bound material, else its displayColor, else grey.

    Raises StageError for a binding to nothing, UnsupportedError for anything but UsdPreviewSurface constants.
    """
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
    if material:
        return read_material(material, time)
    _refuse_dangling(prim)
    gprim = prim.GetParent() if prim.IsA(UsdGeom.Subset) else prim
    return _display_material(gprim, time)


def read_material(material: UsdShade.Material, time: Usd.TimeCode) -> Material:
    """The constants of a material's UsdPreviewSurface; USD's fallbacks for what is not authored."""
    path = str(material.GetPath())
    shader = material.ComputeSurfaceSource()[0]
    if not shader:
        raise UnsupportedError(
            "has no surface for the universal render context", where=path, do="add UsdPreviewSurface"
        )
    if shader.GetIdAttr().Get() != "UsdPreviewSurface":
        found = f"its surface {shader.GetPath()} is '{shader.GetIdAttr().Get()}'"
        raise UnsupportedError(found, where=path, do="use UsdPreviewSurface")
    values = {
        name: _constant(shader, name, time) for name in (*COLORS, *FRACTIONS, *NEUTRAL, "ior", "opacityThreshold")
    }
    where = shader.GetPath()
    for name, neutral in NEUTRAL.items():
        if values[name] is not None and not np.allclose(values[name], neutral):
            raise UnsupportedError(f"its {name} is {values[name]}", where=where, do=f"leave {name} at {neutral}")
    fields: dict[str, Any] = {f: _color(values[n], n, where) for n, f in COLORS.items() if values[n] is not None}
    fields |= {f: _fraction(values[n], n, where) for n, f in FRACTIONS.items() if values[n] is not None}
    if values["ior"] is not None:
        fields["ior"] = _number(values["ior"], "ior", where)
    if (values["opacityThreshold"] or 0) > 0:  # a cut-out: all or nothing
        fields["opacity"] = float(fields.get("opacity", 1.0) >= values["opacityThreshold"])
    specular = bool(_constant(shader, "useSpecularWorkflow", time))
    return Material(path=path, use_specular_workflow=specular, **fields)


def _constant(shader: UsdShade.Shader, name: str, time: Usd.TimeCode) -> Any:
    """The value of a shader's input, followed through its material's interface; None where nothing is authored."""
    shader_input = shader.GetInput(name)
    if not shader_input:
        return None
    where = f"{shader.GetPath()}.inputs:{name}"
    sources = shader_input.GetValueProducingAttributes()
    if not sources:
        if shader_input.HasConnectedSource():
            raise StageError("its connection leads to no value", where=where, do="connect or author a value")
        return None
    if UsdShade.Utils.GetType(sources[0].GetName()) == UsdShade.AttributeType.Output:
        found = f"is connected to {sources[0].GetPrim().GetPath()}, and textures and other nodes are not rendered yet"
        raise UnsupportedError(found, where=where, do="author a constant")
    space = str(sources[0].GetColorSpace()) if sources[0].HasColorSpace() else ""
    if space not in LINEAR:
        raise UnsupportedError(f"is given in colour space '{space}'", where=where, do="author linear Rec. 709 values")
    return sources[0].Get(time)


def _display_material(prim: Usd.Prim, time: Usd.TimeCode) -> Material:
    fields: dict[str, Any] = {}
    for name, field in (("displayColor", "diffuse_color"), ("displayOpacity", "opacity")):
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        value = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
        if value is None or not len(value):
            continue
        distinct = np.unique(np.array(value, np.float64).reshape(len(value), -1), axis=0)
        where = f"{prim.GetPath()}.primvars:{name}"
        if len(distinct) > 1:
            found = f"varies over the surface ({len(distinct)} values)"
            raise UnsupportedError(found, where=where, do="bind a material, or give it one value")
        first = value[0]
        fields[field] = _color(first, name, where) if name == "displayColor" else _fraction(first, name, where)
    return Material(path=f"{prim.GetPath()}.primvars:displayColor", **fields) if fields else FALLBACK


def _refuse_dangling(prim: Usd.Prim) -> None:
    """A binding, here or above, to a prim that is no material must not turn into grey."""
    while prim and not prim.IsPseudoRoot():
        for name in ("material:binding", "material:binding:full"):
            relation = prim.GetRelationship(name)
            if relation and relation.GetTargets():
                found = f"is bound to {relation.GetTargets()[0]}, which is no material"
                raise StageError(found, where=prim.GetPath(), do="bind a material that exists")
        prim = prim.GetParent()


def _color(value: Any, name: str, where: Any) -> Color:
    r, g, b = (_number(channel, name, where) for channel in value)
    return r, g, b


def _fraction(value: Any, name: str, where: Any) -> float:
    number = _number(value, name, where)
    if number > 1:
        raise StageError(f"its {name} is {number:g}", where=where, do="keep it between 0 and 1")
    return number


def _number(value: Any, name: str, where: Any) -> float:
    number = float(value)
    if not np.isfinite(number) or number < 0:
        raise StageError(f"its {name} is {value}", where=where, do="make it finite and not negative")
    return number
