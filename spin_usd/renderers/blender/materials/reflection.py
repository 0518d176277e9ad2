"""Reflection of a surface, as inputs of the Principled BSDF and as a factor of the light that it transmits.

The metallic workflow is Principled's own. The specular workflow's F0 colour becomes an index of refraction and a tint:
Principled's dielectric reflection has that colour head-on and is white at grazing incidence, as the workflow asks.
Above MAX_F0, where that index would grow without bound, it is Principled's metal of that colour; the diffuse part that
it lacks would get less than 1 - MAX_F0 of the light. Source: UsdPreviewSurface specification 2.6; Blender manual,
"Principled BSDF"; Schlick (1994).
"""

from collections.abc import Mapping
from typing import Any

from spin_usd.renderers.blender.materials.nodes import Nodes, Value, varies

MAX_F0 = 0.99  # head-on reflectance that an index of refraction is still sought for
COAT_IOR = 1.5  # of a clearcoat
Inputs = Mapping[str, Value]
"""A material's inputs by its own field names, textures as sockets."""


def principled_inputs(nodes: Nodes, inputs: Inputs, *, specular_workflow: bool) -> dict[str, Value]:
    """Return the inputs of the Principled BSDF, by Blender's names."""
    emission = inputs["emissive_color"]
    reflection = _specular_color(nodes, inputs) if specular_workflow else _metallic(inputs)
    return {
        "Roughness": inputs["roughness"],
        "Coat Weight": inputs["clearcoat"],
        "Coat Roughness": inputs["clearcoat_roughness"],
        "Emission Color": emission,
        "Emission Strength": 1.0 if is_emissive(emission) else 0.0,
        **reflection,
    }


def is_emissive(emission: Value) -> bool:
    """Return whether an emission is more than black."""
    return varies(emission) or any(emission)


def _metallic(inputs: Inputs) -> dict[str, Value]:
    return {"Base Color": inputs["diffuse_color"], "Metallic": inputs["metallic"], "IOR": inputs["ior"]}


def _specular_color(nodes: Nodes, inputs: Inputs) -> dict[str, Value]:
    color, diffuse = inputs["specular_color"], inputs["diffuse_color"]
    f0 = nodes.largest(color)
    if not varies(f0) and f0 == 0:
        return {"Base Color": diffuse, "Metallic": 0.0, "Specular IOR Level": 0.0}
    metal = nodes.math("GREATER_THAN", f0, MAX_F0)
    root = nodes.math("SQRT", nodes.math("MINIMUM", f0, MAX_F0))
    ior = nodes.math("DIVIDE", nodes.math("ADD", 1.0, root), nodes.math("SUBTRACT", 1.0, root))
    if varies(f0):
        base, tint = nodes.blend(metal, diffuse, color), nodes.vector("DIVIDE", color, f0)
        tint = nodes.blend(metal, tint, (1.0, 1.0, 1.0))
        return {"Base Color": base, "Metallic": metal, "IOR": ior, "Specular Tint": tint}
    if metal:
        return {"Base Color": color, "Metallic": 1.0}
    return {"Base Color": diffuse, "Metallic": 0.0, "IOR": ior, "Specular Tint": tuple(c / f0 for c in color)}


def reflectance(nodes: Nodes, inputs: Inputs, normal: Any, *, specular_workflow: bool) -> tuple[Any, bool]:
    """Return the share of light that the surface (under its clearcoat) reflects towards the viewer, and whether it has
    a colour."""
    if specular_workflow:
        return _schlick(nodes, inputs["specular_color"], normal), True
    plain = fresnel(nodes, inputs["ior"], normal)
    metallic = inputs["metallic"]
    if not varies(metallic) and metallic == 0:
        return plain, False
    return nodes.blend(metallic, plain, _schlick(nodes, inputs["diffuse_color"], normal)), True


def fresnel(nodes: Nodes, ior: Value, normal: Any) -> Any:
    """Fresnel's reflectance of a dielectric, the same from both sides.

    The Fresnel node inverts its index at back faces, whose light is not refracted here.
    """
    inside = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
    index = nodes.between(inside, ior, nodes.math("DIVIDE", 1.0, ior))
    return nodes.add("ShaderNodeFresnel", {"IOR": index, **mapped_normal(normal)}).outputs["Fac"]


def _schlick(nodes: Nodes, f0: Value, normal: Any) -> Any:
    """Return the colour F0 + (1 - F0) (1 - cosine)^5."""
    facing = nodes.add("ShaderNodeLayerWeight", {"Blend": 0.5, **mapped_normal(normal)}).outputs["Facing"]
    fifth = nodes.add("ShaderNodeMath", [facing, 5.0], operation="POWER").outputs[0]
    return nodes.vector("MULTIPLY_ADD", nodes.vector("SUBTRACT", 1.0, f0), fifth, f0)


def mapped_normal(normal: Any, *names: str) -> dict[str, Any]:
    """`normal` for the inputs of those names ("Normal" unless given); nothing where a surface has its own."""
    return {} if normal is None else dict.fromkeys(names or ("Normal",), normal)
