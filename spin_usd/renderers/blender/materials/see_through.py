"""Opacity: what of a surface is not there, or lets light through. Light that passes is not refracted.

As UsdPreviewSurface's `transparent` mode asks, a transparent surface keeps reflection and emission; only its diffuse
body fades, and what neither clearcoat nor surface reflects passes. `presence` fades everything. A cut-out is there or
not.
"""

from typing import Any

from spin_usd.renderers.blender.materials.nodes import Nodes, Value, varies
from spin_usd.renderers.blender.materials.reflection import (
    COAT_IOR,
    Inputs,
    fresnel,
    is_emissive,
    mapped_normal,
    reflectance,
)
from spin_usd.scene.material import PRESENCE, Material


def faded(nodes: Nodes, opaque: Any, material: Material, inputs: Inputs, normal: Any) -> Any:
    """Return the shader `opaque` with its material's opacity."""
    share = coverage(nodes, material, inputs["opacity"])
    if not varies(share) and share >= 1:
        return opaque
    if material.cut_out or material.opacity_mode == PRESENCE:
        return nodes.mixed(share, absent(nodes), opaque)
    return nodes.mixed(share, _clear(nodes, material, inputs, normal), opaque)


def coverage(nodes: Nodes, material: Material, opacity: Value) -> Value:
    """Return the opacity itself, or of a cut-out 0 or 1."""
    if not material.cut_out:
        return opacity
    return nodes.math("SUBTRACT", 1.0, nodes.math("LESS_THAN", opacity, material.opacity_threshold))


def absent(nodes: Nodes) -> Any:
    """Return the shader of nothing."""
    return nodes.add("ShaderNodeBsdfTransparent").outputs[0]


def _clear(nodes: Nodes, material: Material, inputs: Inputs, normal: Any) -> Any:
    """Return the surface without its body: reflection, emission, and what passes."""
    share, colored = reflectance(nodes, inputs, normal, specular_workflow=material.use_specular_workflow)
    gloss = {"Roughness": inputs["roughness"], **mapped_normal(normal)}
    if colored:
        passing = nodes.add("ShaderNodeBsdfTransparent", {"Color": nodes.vector("SUBTRACT", 1.0, share)}).outputs[0]
        glossy = nodes.add("ShaderNodeBsdfGlossy", {"Color": share, **gloss}).outputs[0]
        surface = _sum(nodes, passing, glossy)
    else:
        white = (1.0, 1.0, 1.0)
        glossy = nodes.add("ShaderNodeBsdfGlossy", {"Color": white, **gloss}).outputs[0]
        surface = nodes.mixed(share, absent(nodes), glossy)
    if is_emissive(inputs["emissive_color"]):
        surface = _sum(nodes, surface, nodes.add("ShaderNodeEmission", {"Color": inputs["emissive_color"]}).outputs[0])
    return _coated(nodes, surface, inputs, normal)


def _coated(nodes: Nodes, surface: Any, inputs: Inputs, normal: Any) -> Any:
    weight = inputs["clearcoat"]
    if not varies(weight) and weight == 0:
        return surface
    share = nodes.math("MULTIPLY", weight, fresnel(nodes, COAT_IOR, normal))
    gloss = {"Color": (1.0, 1.0, 1.0), "Roughness": inputs["clearcoat_roughness"], **mapped_normal(normal)}
    return nodes.mixed(share, surface, nodes.add("ShaderNodeBsdfGlossy", gloss).outputs[0])


def _sum(nodes: Nodes, first: Any, second: Any) -> Any:
    return nodes.add("ShaderNodeAddShader", (first, second)).outputs[0]
