"""UsdPreviewSurface constants as Cycles materials.

The metallic workflow is Principled's own. The specular workflow's F0 colour becomes an index of refraction and a tint:
Principled's dielectric reflection has that colour head-on and is white at grazing incidence, as the workflow asks.
Source: UsdPreviewSurface specification 2.6; Blender manual, "Principled BSDF".
"""

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from spin_usd.errors import UnsupportedError
from spin_usd.scene.material import Material
from spin_usd.scene.texture import Color

FACE_NUMBER = "face"  # the mesh attribute that holds a face's index + 1, so that 0 is nothing
MAX_F0 = 0.99  # head-on reflectance that an index of refraction is still sought for
UNIT_INTERVAL = ("metallic", "roughness", "clearcoat", "clearcoat_roughness", "opacity")


class MaterialLibrary:
    """One Blender material per distinct surface; those that no face uses any more are freed."""

    def __init__(self) -> None:
        self._built: dict[str, Any] = {}
        self._current: tuple[Material, ...] = ()

    def assign(self, meshes: Sequence[Any], materials: Sequence[Material], *, again: bool) -> None:
        """Give the Blender meshes these materials, in this order. `again` where a mesh is new."""
        wanted = tuple(materials)
        if wanted == self._current and not again:
            return
        for material in wanted:
            check_material(material)
            if material.key not in self._built:
                self._built[material.key] = surface_material(material)
        for mesh in meshes:
            _fill_slots(mesh.materials, [self._built[material.key] for material in wanted])
        self._current = wanted
        self._forget()

    @property
    def emissive(self) -> bool:
        return any(any(m.emissive_color) for m in self._current)

    @property
    def transparent(self) -> bool:
        return any(m.opacity < 1 for m in self._current)

    def _forget(self) -> None:
        used = {material.key for material in self._current}
        for key in set(self._built) - used:
            bpy.data.materials.remove(self._built.pop(key))


def _fill_slots(slots: Any, materials: Sequence[Any]) -> None:
    """Make a mesh's material slots these. Never by `clear()`, which sets every face's material to the first."""
    while len(slots) > len(materials):
        slots.pop()
    for i, material in enumerate(materials):
        if i < len(slots):
            slots[i] = material
        else:
            slots.append(material)


def label_material() -> Any:
    """Every face glows with its own number, as linear light."""
    material, nodes, links = _empty_material("label")
    number = nodes.new("ShaderNodeAttribute")
    number.attribute_name = FACE_NUMBER
    glow, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    links.new(number.outputs["Fac"], glow.inputs["Color"])
    links.new(glow.outputs["Emission"], output.inputs["Surface"])
    material.cycles.emission_sampling = "NONE"  # millions of light sources that light nothing
    return material


def surface_material(material: Material) -> Any:
    """The Cycles material of a UsdPreviewSurface that `check_material` accepts."""
    result, nodes, links = _empty_material("surface")
    principled, output = nodes.new("ShaderNodeBsdfPrincipled"), nodes.new("ShaderNodeOutputMaterial")
    for name, value in principled_inputs(material).items():
        principled.inputs[name].default_value = value
    surface = principled.outputs["BSDF"]
    if material.opacity < 1:
        surface = _see_through(nodes, links, surface, material)
    links.new(surface, output.inputs["Surface"])
    return result


def principled_inputs(material: Material) -> dict[str, Any]:
    """Values of the Principled BSDF's inputs, by Blender's names."""
    specular = _specular(material)
    return {
        "Base Color": (*material.diffuse_color, 1.0),
        "Roughness": material.roughness,
        "Coat Weight": material.clearcoat,
        "Coat Roughness": material.clearcoat_roughness,
        "Emission Color": (*material.emissive_color, 1.0),
        "Emission Strength": 1.0 if any(material.emissive_color) else 0.0,
        **specular,
    }


def _specular(material: Material) -> dict[str, Any]:
    """Metallic, index of refraction and tint, of either workflow."""
    if not material.use_specular_workflow:
        return {"Metallic": material.metallic, "IOR": material.ior}
    f0 = max(material.specular_color)
    if f0 == 0:
        return {"Metallic": 0.0, "Specular IOR Level": 0.0}
    tint: Color = tuple(c / f0 for c in material.specular_color)  # type: ignore[assignment]
    ior = (1 + f0**0.5) / (1 - f0**0.5)
    return {"Metallic": 0.0, "IOR": ior, "Specular Tint": (*tint, 1.0)}


def check_material(material: Material) -> None:
    """Raise UnsupportedError, with the material's path, for constants that cannot be drawn as they are meant."""
    colors = (material.diffuse_color, material.emissive_color, material.specular_color)
    if not np.isfinite(colors).all() or np.min(colors) < 0:
        raise UnsupportedError(f"colours {colors} hold NaN, infinity or negative light", where=material.path)
    for name in UNIT_INTERVAL:
        value = getattr(material, name)
        if not 0 <= value <= 1:
            raise UnsupportedError(f"{name} is {value}, expected 0 to 1", where=material.path)
    if max(material.diffuse_color) > 1:
        raise UnsupportedError(f"diffuseColor {material.diffuse_color} reflects more than arrives", where=material.path)
    if not (np.isfinite(material.ior) and material.ior >= 1):
        raise UnsupportedError(f"ior is {material.ior}, expected 1 or more", where=material.path)
    if material.use_specular_workflow and max(material.specular_color) > MAX_F0:
        raise UnsupportedError(
            f"specularColor {material.specular_color} is above {MAX_F0}", where=material.path, do="use metallic instead"
        )
    mixed = material.metallic > 0 or material.use_specular_workflow or material.clearcoat > 0
    if material.opacity < 1 and (mixed or any(material.emissive_color)):
        raise UnsupportedError(
            f"opacity {material.opacity} together with metallic, specular workflow, clearcoat or emission",
            where=material.path,
            do="make it opaque or a plain dielectric",
        )


def _see_through(nodes: Any, links: Any, opaque: Any, material: Material) -> Any:
    """The shader `opaque` with its body faded by opacity but its reflection kept, as UsdPreviewSurface's
    default opacity mode asks; light that passes is not refracted."""
    inside = nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    ior = nodes.new("ShaderNodeMix")  # the Fresnel node inverts its index at back faces, whose light is not refracted
    links.new(inside, ior.inputs["Factor"])
    ior.inputs["A"].default_value, ior.inputs["B"].default_value = material.ior, 1 / material.ior
    fresnel = nodes.new("ShaderNodeFresnel")
    links.new(ior.outputs["Result"], fresnel.inputs["IOR"])
    glossy = nodes.new("ShaderNodeBsdfGlossy")
    glossy.inputs["Roughness"].default_value = material.roughness
    clear = _mix(
        nodes, links, fresnel.outputs["Fac"], nodes.new("ShaderNodeBsdfTransparent").outputs[0], glossy.outputs[0]
    )
    mixed = _mix(nodes, links, None, clear, opaque)
    mixed.node.inputs[0].default_value = material.opacity
    return mixed


def _mix(nodes: Any, links: Any, factor: Any, first: Any, second: Any) -> Any:
    """Output of a Mix Shader node: `first` at factor 0, `second` at 1."""
    mix = nodes.new("ShaderNodeMixShader")
    if factor is not None:
        links.new(factor, mix.inputs[0])
    links.new(first, mix.inputs[1])
    links.new(second, mix.inputs[2])
    return mix.outputs[0]


def _empty_material(name: str) -> tuple[Any, Any, Any]:
    """A new material, with the nodes and links of its empty tree."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree.nodes, tree.links
