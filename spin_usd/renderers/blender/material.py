"""UsdPreviewSurface as Cycles materials, and the materials of the label picture.

Source: UsdPreviewSurface specification 2.6; Blender manual, "Principled BSDF".
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.renderers.blender.nodes import Nodes, Value, varies
from spin_usd.renderers.blender.textures import ImageLibrary, attribute_name, node_value
from spin_usd.scene.derived.lookup import bounds, extremes
from spin_usd.scene.material import LIMITS, PRESENCE, Material
from spin_usd.scene.mesh import Mesh
from spin_usd.scene.shape import Shape
from spin_usd.scene.texture import Primvar, Texture

FACE_NUMBER = "face"  # the mesh attribute that holds a face's index in its mesh + 1, so that 0 is nothing
FIRST_NUMBER = "first"  # the object's property that holds how many faces are numbered before its own
LABEL = "label"
EVERY = tuple(LIMITS)
BLACK = (0.0, 0.0, 0.0)
CUT = ("opacity",)  # the inputs that labels depend on
FIELDS = ("diffuse_color", "emissive_color", "specular_color", "metallic", "roughness", "clearcoat",
          "clearcoat_roughness", "opacity", "ior")  # fmt: skip
MAX_F0 = 0.99  # head-on reflectance that an index of refraction is still sought for
COAT_IOR = 1.5  # of a clearcoat
Inputs = Mapping[str, Value]
"""A material's inputs by its own field names, textures as sockets."""


class MaterialLibrary:
    """One Blender material per distinct surface; unused ones are freed, with their images."""

    def __init__(self) -> None:
        self._built: dict[str, Any] = {}
        self._images = ImageLibrary()
        self._used: dict[str, dict[str, Material]] = {}  # by the last pass of each kind, under their keys
        self._shown: list[str] = []
        self._checked: dict[tuple[str, ...], set[Material]] = {}

    def set_materials(
        self,
        meshes: Sequence[Any],
        materials: Sequence[Material],
        mesh: Mesh,
        *,
        again: bool,
    ) -> None:
        """Give the surfaces of `mesh` their materials.

        Raises UnsupportedError, with the material's path.

        Args:
            meshes: Blender's, of `mesh` or of its groups of faces.
            materials: Materials of `mesh`, in the order of its faces' indices.
            again: Whether the Blender meshes are new, without earlier materials.
        """
        self._check(materials, mesh, EVERY, again=again)
        keys = [material.key for material in materials]
        self._used["surface"] = dict(zip(keys, materials, strict=True))
        self._show(meshes, keys, surface_material, again=again)

    def show_face_ids(self, meshes: Sequence[Any], materials: Sequence[Material], mesh: Mesh, *, again: bool) -> None:
        """Let every face of the Blender meshes of `mesh` emit its number, where it is not cut out."""
        self._check(materials, mesh, CUT, again=again)
        keys = [_label_key(material) for material in materials]
        self._used[LABEL] = dict(zip(keys, materials, strict=True))
        self._show(meshes, keys, label_material, again=again)

    def _check(self, materials: Sequence[Material], mesh: Mesh, inputs: tuple[str, ...], *, again: bool) -> None:
        """Check inputs that were not checked before with this mesh; for the labels only cut-outs."""
        if again:
            self._checked.clear()
        checked = self._checked.get(inputs, set())
        for index, material in enumerate(materials):
            if material not in checked and (inputs is EVERY or material.cut_out):
                for shape, faces in _showing(mesh, index):
                    check_material(material, shape, faces, inputs)
        self._checked[inputs] = set(materials)

    def _show(
        self,
        meshes: Sequence[Any],
        keys: list[str],
        make: Callable[[Material, ImageLibrary], Any],
        *,
        again: bool,
    ) -> None:
        """Fill the meshes' slots with what `make` makes of the materials in use under these keys; each is kept."""
        if keys == self._shown and not again:
            return
        used = {key: material for of_kind in self._used.values() for key, material in of_kind.items()}
        for key in keys:
            if key not in self._built:
                self._built[key] = make(used[key], self._images)
        for mesh in meshes:
            _fill_slots(mesh.materials, [self._built[key] for key in keys])
        self._shown = keys
        for key in set(self._built) - set(used):
            bpy.data.materials.remove(self._built.pop(key))
        self._images.keep(used.values())


def _showing(mesh: Mesh, index: int) -> list[tuple[Shape, NDArray[np.bool_]]]:
    """Return the shapes with faces (F,) of the material, and which these are; the mesh's own without any where none
    has."""
    found = [(shape, np.asarray(shape.face_material == index)) for shape in mesh.shapes]
    return [each for each in found if each[1].any()] or [(mesh, np.zeros(len(mesh.faces), bool))]


def _label_key(material: Material) -> str:
    return f"{LABEL} {material.key}" if material.cut_out else LABEL


def _fill_slots(slots: Any, materials: Sequence[Any]) -> None:
    """Make a mesh's material slots these. Never by `clear()`, which sets every face's material to the first."""
    while len(slots) > len(materials):
        slots.pop()
    for i, material in enumerate(materials):
        if i < len(slots):
            slots[i] = material
        else:
            slots.append(material)


def label_material(cut: Material | None = None, images: ImageLibrary | None = None) -> Any:
    """Return a material by which every face emits its own number, as linear light; it is transparent where `cut` cuts
    it out."""
    nodes = Nodes("label")
    face = nodes.add("ShaderNodeAttribute", attribute_name=FACE_NUMBER).outputs["Vector"]
    first = nodes.add("ShaderNodeAttribute", attribute_name=FIRST_NUMBER, attribute_type="OBJECT").outputs["Vector"]
    number = nodes.vector("ADD", face, first)
    shader = nodes.add("ShaderNodeEmission", {"Color": number}).outputs["Emission"]
    if cut is not None and images is not None and cut.cut_out:
        share = coverage(nodes, cut, node_value(nodes, images, cut.opacity))
        shader = nodes.mixed(share, absent(nodes), shader)
    material = nodes.surface(shader)
    material.cycles.emission_sampling = "NONE"  # millions of light sources that light nothing
    return material


def surface_material(material: Material, images: ImageLibrary) -> Any:
    """Return the Cycles material of a UsdPreviewSurface that `check_material` accepts."""
    if isinstance(material.emissive_color, Texture) and not extremes(material.emissive_color).any():
        material = replace(material, emissive_color=BLACK)  # else rays would look for light in it
    nodes = Nodes("surface")
    inputs = {name: node_value(nodes, images, getattr(material, name)) for name in FIELDS}
    normal = _normal(nodes, images, material)
    feeds = principled_inputs(nodes, inputs, specular_workflow=material.use_specular_workflow)
    principled = nodes.add("ShaderNodeBsdfPrincipled", {**feeds, **mapped_normal(normal, "Normal", "Coat Normal")})
    return nodes.surface(faded(nodes, principled.outputs["BSDF"], material, inputs, normal))


def _normal(nodes: Nodes, images: ImageLibrary, material: Material) -> Any:
    """Return the shading normal by a material's normal map; None where it leaves the surface's own.

    The Normal Map node takes its tangents from the texture's own UV map, and decodes colours: 0 to 1 is -1 to 1.
    """
    if material.normal is None or material.normal == (0, 0, 1):
        return None
    tangent = node_value(nodes, images, material.normal)
    color: Value = tuple(0.5 * c + 0.5 for c in tangent) if not varies(tangent) else None
    if color is None:
        color = nodes.vector("MULTIPLY_ADD", tangent, 0.5, 0.5)
    along = attribute_name(material.tangent_primvar)
    node = nodes.add("ShaderNodeNormalMap", {"Strength": 1.0, "Color": color}, space="TANGENT", uv_map=along)
    return node.outputs["Normal"]


def faded(nodes: Nodes, opaque: Any, material: Material, inputs: Inputs, normal: Any) -> Any:
    """Return the shader `opaque` with its material's opacity: absent or transparent parts of a surface.

    `presence` fades everything, `transparent` what `_clear` leaves out. A cut-out is binary. Transmitted light is not
    refracted.
    """
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
    """Return the surface without its body: reflection, emission, and transmission.

    As UsdPreviewSurface's `transparent` mode requires, a transparent surface keeps reflection and emission; only its
    diffuse body fades, and what neither clearcoat nor surface reflects passes.
    """
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


def check_material(material: Material, mesh: Shape, faces: NDArray[np.bool_], inputs: Iterable[str] = LIMITS) -> None:
    """Raise UnsupportedError, with the material's path, if one of its `inputs` cannot be rendered as intended, or reads
    a primvar that `mesh` lacks; `faces` (F,) marks the faces with the material."""
    for name in inputs:
        value = getattr(material, name)
        if value is not None:
            _check(value, name, material.path, mesh, faces)
        if name == "normal" and value not in (None, (0, 0, 1)):
            _primvar(mesh, material.tangent_primvar, 2, name, material.path)


def _check(value: Any, name: str, path: str, mesh: Shape, faces: NDArray[np.bool_]) -> None:
    limits = LIMITS[name]
    size, given = limits.size, limits.size
    if isinstance(value, Primvar):
        numbers = _primvar(mesh, value.name, size, limits.name, path)[faces]
        if not numbers.size:
            return
    elif isinstance(value, Texture):
        if value.coordinates.primvar is not None:
            _primvar(mesh, value.coordinates.primvar, 2, limits.name, path)
        numbers = bounds(value)
        if not limits.low <= numbers.min() <= numbers.max() <= limits.high:
            numbers = extremes(value)
        given = numbers.shape[1]
    else:
        numbers = np.asarray(value, np.float64)
    if given != size:
        found = f"its {limits.name} takes {size} numbers, its texture gives {given}"
        raise UnsupportedError(found, where=path, do="use another output of the texture")
    if not (np.isfinite(numbers).all() and limits.low <= numbers.min() and numbers.max() <= limits.high):
        found = f"its {limits.name} lies between {numbers.min():g} and {numbers.max():g}"
        raise UnsupportedError(found, where=path, do=f"keep it finite and between {limits.low:g} and {limits.high:g}")


def _primvar(mesh: Shape, name: str, size: int, used_by: str, path: str) -> Any:
    """Return the values of the primvar; UnsupportedError unless the mesh has it with `size` components."""
    if name not in mesh.primvars:
        raise UnsupportedError(
            f"its {used_by} reads the primvar {name}, which its mesh lacks", where=path, do="author it"
        )
    values = mesh.primvars[name]
    if values.shape[2] != size:
        found = f"its {used_by} reads the primvar {name} of {values.shape[2]} components, expected {size}"
        raise UnsupportedError(found, where=path, do="give the primvar as many")
    return values


def principled_inputs(nodes: Nodes, inputs: Inputs, *, specular_workflow: bool) -> dict[str, Value]:
    """Return the inputs of the Principled BSDF, by Blender's names; the metallic workflow is its own."""
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
    """Return the specular workflow's F0 colour as an index of refraction and a tint.

    Principled's dielectric reflection has that colour head-on and is white at grazing incidence, by the workflow.
    Above MAX_F0, where that index would grow without bound, it is Principled's metal of that colour; the diffuse part
    that it lacks would get less than 1 - MAX_F0 of the light.
    """
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
    """Return the colour F0 + (1 - F0) (1 - cosine)^5. Source: Schlick (1994)."""
    facing = nodes.add("ShaderNodeLayerWeight", {"Blend": 0.5, **mapped_normal(normal)}).outputs["Facing"]
    fifth = nodes.add("ShaderNodeMath", [facing, 5.0], operation="POWER").outputs[0]
    return nodes.vector("MULTIPLY_ADD", nodes.vector("SUBTRACT", 1.0, f0), fifth, f0)


def mapped_normal(normal: Any, *names: str) -> dict[str, Any]:
    """`normal` for the inputs of those names ("Normal" unless given); nothing where a surface has its own."""
    return {} if normal is None else dict.fromkeys(names or ("Normal",), normal)
