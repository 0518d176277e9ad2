"""Parameters of materials: inputs of the UsdPreviewSurfaces below the target, and any attribute by its path."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdShade

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.stage.augment.attribute_change import AttributeChange, BaseStage, ChangedAttribute, attribute_of
from spin_usd.stage.read.bodies.find_bodies import find_targets
from spin_usd.stage.usd.shader_inputs import PREVIEW_SURFACE, Output, read_input
from spin_usd.stage.usd.values import read

COLORS = ("diffuseColor", "specularColor", "emissiveColor")
FALLBACKS: dict[str, tuple[float, ...]] = {
    "roughness": (0.5,),
    "metallic": (0.0,),
    "clearcoat": (0.0,),
    "clearcoatRoughness": (0.01,),
    "opacity": (1.0,),
    "ior": (1.5,),
    "diffuseColor": (0.18, 0.18, 0.18),
    "specularColor": (0.0, 0.0, 0.0),
    "emissiveColor": (0.0, 0.0, 0.0),
}
"""The fallbacks in UsdPreviewSurface's specification: an input has this value unless one is authored."""
FACTOR = ".factor"
CHANNELS: dict[str, tuple[int, ...]] = {"r": (0,), "g": (1,), "b": (2,), "a": (3,), "rgb": (0, 1, 2), "rgba": (0, 1, 2)}


def material_input(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """material.NAME.INPUT is replaced by the value; material.NAME.INPUT.factor multiplies the existing value or
    image."""
    (parameter,) = names
    name, _, rest = parameter.removeprefix("material.").partition(".")
    factor, of = rest.endswith(FACTOR), rest.removesuffix(FACTOR)
    parts: list[tuple[ChangedAttribute, Callable[[Any], Any]]] = []
    for _, shader in surfaces_named(base, name, parameter):
        parts += factors(shader, of, base.first) if factor else [replaced(shader, of)]
    unique = {str(attribute): (attribute, make) for attribute, make in parts}
    attributes = tuple(attribute for attribute, _ in unique.values())
    makers = tuple(make for _, make in unique.values())
    return AttributeChange(
        parameters=names,
        attributes=attributes,
        values=lambda sampled, _: tuple(make(sampled[parameter]) for make in makers),
    )


def material_names(stage: Usd.Stage) -> tuple[str, ...]:
    """Return the names of the targets' materials, each once, in alphabetical order."""
    return tuple(sorted({material.GetPrim().GetName() for material in _materials(stage)}))


def _materials(stage: Usd.Stage) -> list[UsdShade.Material]:
    below = (prim for target in find_targets(stage) for prim in Usd.PrimRange(target))
    return [UsdShade.Material(prim) for prim in below if prim.IsA(UsdShade.Material)]


def surfaces_named(base: BaseStage, name: str, parameter: str) -> list[tuple[UsdShade.Material, UsdShade.Shader]]:
    """Find the targets' materials of that name, or all for "*", that have a UsdPreviewSurface, with it."""
    chosen = [each for each in _materials(base.stage) if name in ("*", each.GetPrim().GetName())]
    if not chosen:
        names = ", ".join(material_names(base.stage)[:20]) or "none that can be overridden"
        raise InputError(f"no target has a material {name!r}", where=parameter, do=f"it has {names}")
    found = ((material, material.ComputeSurfaceSource()[0]) for material in chosen)
    return [each for each in found if each[1] and read(each[1].GetIdAttr()) == PREVIEW_SURFACE]


def replaced(shader: UsdShade.Shader, name: str) -> tuple[ChangedAttribute, Callable[[Any], Any]]:
    """Give the input the sampled value, one number for all three channels; a connected image is disconnected."""
    size = len(FALLBACKS[name])
    kind = "float" if size == 1 else "color3f"
    connected = bool(shader.GetInput(name)) and shader.GetInput(name).HasConnectedSource()
    at = ChangedAttribute(prim=str(shader.GetPath()), name=f"inputs:{name}", type=kind, cut=connected)
    return at, (float if size == 1 else _color)


def _color(value: Any) -> Gf.Vec3f:
    return Gf.Vec3f(*(float(v) for v in value)) if isinstance(value, tuple) else Gf.Vec3f(float(value))


def factors(
    shader: UsdShade.Shader, name: str, time: Usd.TimeCode
) -> list[tuple[ChangedAttribute, Callable[[Any], Any]]]:
    """Multiply the input's value; where an image is connected, its scale and bias."""
    found = read_input(shader, name, time)
    if not isinstance(found, Output):
        own = np.array(FALLBACKS[name] if found is None else found, np.float64).reshape(-1)
        kind = "float" if own.size == 1 else "color3f"
        at = ChangedAttribute(prim=str(shader.GetPath()), name=f"inputs:{name}", type=kind)
        return [(at, _scaled(own, tuple(range(own.size)), lambda v: Gf.Vec3f(*v) if v.size == 3 else float(v[0])))]
    if found.node != "UsdUVTexture":
        do = "give it a value or an image, or replace it without .factor"
        raise InputError(f"its {name} comes from a {found.node}", where=shader.GetPath(), do=do)
    return [
        (attribute, _scaled(own, CHANNELS[found.name], lambda v: Gf.Vec4f(*v)))
        for attribute, own in _scale_and_bias(found.shader, time)
    ]


def _scale_and_bias(texture: UsdShade.Shader, time: Usd.TimeCode) -> list[tuple[ChangedAttribute, Float]]:
    found = []
    for name, fallback in (("scale", (1.0, 1.0, 1.0, 1.0)), ("bias", (0.0, 0.0, 0.0, 0.0))):
        value = read_input(texture, name, time)
        if value is None and name == "bias":
            continue
        own = np.array(fallback if value is None else value, np.float64)
        found.append((ChangedAttribute(prim=str(texture.GetPath()), name=f"inputs:{name}", type="float4"), own))
    return found


def _scaled(own: Float, channels: tuple[int, ...], made: Callable[[Float], Any]) -> Callable[[Any], Any]:
    def scaled(factor: Any) -> Any:
        factors = np.ones(own.size)
        factors[list(channels)] = factor
        return made(own * factors)

    return scaled


def attribute_by_path(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Set an attribute that the stage has, the value cast to its type."""
    (name,) = names
    attribute = base.stage.GetAttributeAtPath(name) if Sdf.Path.IsValidPathString(name)[0] else None
    if not attribute or not attribute.IsDefined():
        raise InputError("the stage has no such attribute", where=name, do="give its prim's path, a dot and its name")
    at, kind = attribute_of(attribute, cut=attribute.HasAuthoredConnections()), attribute.GetTypeName()
    return AttributeChange(
        parameters=names, attributes=(at,), values=lambda sampled, _: (_cast(sampled[name], kind, name),)
    )


def _cast(value: Any, kind: Sdf.ValueTypeName, name: str) -> Any:
    make = type(kind.defaultValue)
    try:
        if issubclass(make, bool | int | str) and make(value) != value:
            raise TypeError(value)
        return make(*value) if isinstance(value, tuple) else make(value)
    except (TypeError, ValueError):
        raise InputError(
            f"does not take {value!r}: it is a {kind}", where=name, do="sample values of that type"
        ) from None
