"""Models that Blender reads, FBX, its own, and glTF at a time of its animations, as GLB, as rendered, in metres.

Scripts of a .blend are not run. Files that a model names are plain files below one folder: other images are left out,
with a note, and a model that needs anything else from elsewhere is refused, before anything is written.
"""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy

from spin_usd.errors import InputError
from spin_usd.scene.converted_model import ConvertedModel, ModelToConvert

GLTF_ADDON = "io_scene_gltf2"
KEPT = ("ShaderNodeBsdfPrincipled", "ShaderNodeEmission")
"""Shaders that the exporter writes."""
METALS = ("ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfMetallic")
IMAGES = ("ShaderNodeTexImage", "ShaderNodeVertexColor", "ShaderNodeAttribute")
PLUMBING = ("ShaderNodeGroup", "NodeGroupInput", "NodeReroute")
FOLLOWED = {
    *(*IMAGES, *PLUMBING, "ShaderNodeTexCoord", "ShaderNodeUVMap", "ShaderNodeMapping", "ShaderNodeNormalMap"),
    *("ShaderNodeSeparateColor", "ShaderNodeRGB", "ShaderNodeValue"),
}
"""Nodes between an image and a shader that the exporter writes, as far as glTF has them."""


def convert_model(model: ModelToConvert) -> ConvertedModel:
    """Write a model as GLB. Raises InputError for a file that Blender cannot read."""
    source, to, root, model_time = model.source, model.to, model.root, model.model_time
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with _converting(source, to):
        if source.lower().endswith(".fbx"):
            bpy.ops.wm.fbx_import(filepath=source, use_anim=model_time is not None)
        elif source.lower().endswith((".glb", ".gltf")):
            bpy.ops.preferences.addon_enable(module=GLTF_ADDON)
            bpy.ops.import_scene.gltf(filepath=source)
        else:
            bpy.ops.wm.open_mainfile(filepath=source, use_scripts=False, load_ui=False)
    notes = list(_without_images_from_elsewhere(Path(source).parent, Path(root)))
    _refuse_outside(source, Path(root))
    notes += [*_at_time(source, model_time), *_as_rendered(), *_as_principled()]
    for each in bpy.data.objects:
        if each.data is not None and each.data.users == 1 and each.data.library is None:
            each.data.name = each.name  # by which people know a part
    refraction = _refraction()
    with _converting(source, to):
        _export(to)
    unit = bpy.context.scene.unit_settings
    return ConvertedModel(metres_per_unit=float(unit.scale_length), notes=tuple(notes), refraction=refraction)


def _export(filepath: str) -> None:
    bpy.ops.preferences.addon_enable(module=GLTF_ADDON)
    bpy.ops.export_scene.gltf(
        filepath=filepath,
        export_format="GLB",
        export_apply=True,
        export_gn_mesh=True,
        export_animations=False,
        export_skins=False,
        export_morph=False,
        export_cameras=False,
        export_lights=False,
        export_yup=False,  # the body axes are the axes that Blender shows
        export_current_frame=True,
        export_rest_position_armature=False,  # objects on a bone follow the pose
        use_renderable=True,
    )


def _refraction() -> dict[str, float]:
    """Take the level of specular reflection out of each surface, and return, by its material's name, the index of
    refraction that reflects as much head-on: the exporter leaves that of what transmits no light out."""
    found = {}
    for material in bpy.data.materials:
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.bl_idname != "ShaderNodeBsdfPrincipled":
                continue
            ior, level = node.inputs["IOR"], node.inputs["Specular IOR Level"]
            if ior.is_linked or level.is_linked or node.inputs["Transmission Weight"].default_value:
                continue
            head_on = min(abs(ior.default_value - 1) / (ior.default_value + 1) * (2 * level.default_value) ** 0.5, 0.99)
            level.default_value = 0.5
            found[material.name] = (1 + head_on) / (1 - head_on)
    return found


@contextmanager
def _converting(source: str, to: str) -> Iterator[None]:
    """Give whatever Blender's importers and exporters raise as InputError on the file `source`."""
    try:
        yield
    except Exception as error:
        text = str(error).replace(to, source).replace(source, Path(source).name)
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        told = [line for line in lines if not line.startswith("Location:")] or [type(error).__name__]
        said = told[-1] if any("Traceback" in line for line in told) else told[0].removeprefix("Error: ")
        raise InputError(f"cannot be read by Blender ({said})", where=source, do="copy or export it again") from error


def _refuse_outside(source: str, root: Path) -> None:
    """Raise InputError for a model that takes more than images from elsewhere, or from special files: linked files,
    caches of geometry, volumes, fonts, sounds. If the kernel confines this process, none was opened.

    Texts show nothing; nor does a library that a .blend only remembers as the origin of brushes or of what was
    appended."""
    for text in list(bpy.data.texts):
        bpy.data.texts.remove(text)
    named = bpy.utils.blend_paths(absolute=True, packed=False, local=False)
    needed = {path for path in named if not path.lower().endswith(".blend")}
    for path in sorted({*needed, *(bpy.path.abspath(each.filepath) for each in bpy.data.libraries)}):
        if path and not path.startswith("<") and (lies := _elsewhere(root, Path(path))):
            do = "append or pack it in Blender, apply its users, or give --root"
            raise InputError(f"takes {path}, which {lies}", where=source, do=do)
    for tree in bpy.data.node_groups:
        if node := next((each for each in tree.nodes if each.bl_idname.startswith("GeometryNodeImport")), None):
            found = f"imports files by geometry nodes ({node.name!r} of {tree.name!r})"
            raise InputError(found, where=source, do="apply the modifier in Blender")


def _without_images_from_elsewhere(folder: Path, root: Path) -> Iterator[str]:
    """Remove images that are missing or not plain files below `root`; yield a note on each."""
    for image in list(bpy.data.images):
        if image.source in ("GENERATED", "VIEWER") or image.packed_file:
            continue
        if not image.filepath or Path(bpy.path.abspath(image.filepath)).is_dir():
            yield "a texture of the model names no file, and was left out"
            bpy.data.images.remove(image)
            continue
        own = folder / re.split(r"[\\/]", image.filepath)[-1]  # for the path of another machine
        if own.is_file() and not Path(bpy.path.abspath(image.filepath, start=str(folder))).is_file():
            image.filepath = str(own)
        named = bpy.path.abspath(image.filepath, start=str(folder), library=image.library)
        files = [Path(named.replace("<UDIM>", str(tile.number))) for tile in image.tiles] or [Path(named)]
        lies = next((found for file in files if (found := _elsewhere(root, file))), None)
        if lies or not all(file.is_file() for file in files):
            yield f"the texture {Path(named).name!r} {lies or 'is missing'}, and was left out"
            bpy.data.images.remove(image)
        elif len(files) > 1:
            yield f"the texture {Path(named).name!r} has {len(files)} tiles, of which the first is shown on all"


def _elsewhere(root: Path, path: Path) -> str | None:
    """Return the reason against opening that path, None if it may be opened or does not exist."""
    if not path.resolve().is_relative_to(root):
        return "lies outside the model's folder"
    return "is not a plain file" if os.path.lexists(path) and not path.is_file() else None


def _at_time(source: str, model_time: float | None) -> Iterator[str]:
    """Go to a time of the animations, or yield a note on that at which the file was saved."""
    scene = bpy.context.scene
    begins = [each.frame_range[0] for each in bpy.data.actions if each.users > each.use_fake_user]
    if model_time is not None:
        if not begins:
            raise InputError("has no animations, and a model time is given", where=source, do="leave --model-time out")
        at = min(begins) + model_time * scene.render.fps / scene.render.fps_base
        scene.frame_set(int(at // 1), subframe=at % 1)
    elif begins:
        stands = f"it has animations, and is shown at frame {scene.frame_current}, at which it was saved"
        yield f"{stands}; --model-time 0 shows where they begin"


def _as_rendered() -> Iterator[str]:
    """Make the exporter, which exports the viewport's state, export the rendered state; yield a note on losses."""
    shown = set(bpy.context.view_layer.objects)
    copied = {each.instance_collection for each in shown if each.instance_type == "COLLECTION"}
    for collection in _excluded(bpy.context.view_layer.layer_collection):
        for each in collection.objects if collection not in copied else ():
            each.hide_render = each.hide_render or each not in shown
    for each in bpy.data.objects:
        if each.type == "META" and not each.hide_render:
            yield f"the metaball {each.name!r} was left out: convert it to a mesh in Blender"
        if each.type == "MESH" and not each.hide_render and any(edge.is_loose for edge in each.data.edges):
            yield f"the edges of {each.name!r} that have no faces were left out"
        for modifier in each.modifiers:
            modifier.show_viewport = modifier.show_render
            if hasattr(modifier, "render_levels"):
                modifier.levels = modifier.render_levels


def _excluded(layer: Any) -> Iterator[Any]:
    """Yield the collections at and below a layer's that are excluded from it."""
    if layer.exclude:
        yield layer.collection
    for child in layer.children:
        yield from _excluded(child)


def _as_principled() -> list[str]:
    """Give each material whose surface has no Principled BSDF one, from usable inputs: otherwise the exporter would
    make white metal. Return a note on each, and on what comes from nodes that no file of others holds."""
    notes = []
    for material in bpy.data.materials:
        name, output = repr(material.name), material.node_tree and material.node_tree.get_output_node("ALL")
        found = _behind(output.inputs["Surface"]) if output else []
        shaders = [each for each in found if each.bl_idname not in PLUMBING]
        kept = next((each for each in shaders if each.bl_idname in KEPT), None)
        if kept is None:
            what = str(shaders[0].name) if shaders else "no shader"  # it is gone then
            own = next((each for each in shaders if "Color" in each.inputs), None)
            _set_principled(material, *_taken(material, own))
            notes.append(f"the material {name} has {what}, and no Principled BSDF: only its colour is taken")
        elif kept != shaders[0]:
            notes.append(f"the material {name} has {shaders[0].name}: of its shaders {kept.name} alone is taken")
        else:
            notes += [f"the material {name} has {remark}" for each in kept.inputs for remark in _passed_over(each)]
    return notes


def _passed_over(socket: Any) -> Iterator[str]:
    """Yield features of a shader's input that the exporter does not write. A height map, which it would write as a
    normal map, is cut off."""
    nodes = list(_behind(socket))
    kinds = {each.bl_idname for each in nodes}
    if kinds and kinds.isdisjoint(IMAGES):
        yield f"{socket.name} from nodes, which are left out"
    elif "ShaderNodeBump" in kinds:
        yield f"a height map behind {socket.name} (ShaderNodeBump), which is left out: bake it as a normal map"
        socket.id_data.links.remove(socket.links[0])
    elif over := [said for each in nodes if (said := _unwritten(each, socket))]:
        between = f"{', '.join(over)} between an image and {socket.name}"
        yield f"{between}, which the image is shown without: bake it in Blender"


def _unwritten(node: Any, socket: Any) -> str | None:
    """Name the part of a node behind a shader's input that the exporter ignores, None for none."""
    if node.bl_idname == "ShaderNodeTexImage" and node.projection != "FLAT":
        return f"{node.projection.lower()} projection"
    if node.bl_idname == "ShaderNodeTexCoord":
        return next((f"{each.name} coordinates" for each in node.outputs if each.is_linked and each.name != "UV"), None)
    factor = getattr(node, "blend_type", "") == "MULTIPLY" or (socket.name == "Alpha" and "Math" in node.bl_idname)
    return None if factor or node.bl_idname in FOLLOWED else str(node.name)


def _behind(socket: Any) -> Iterator[Any]:
    """Yield the nodes behind an input, and within groups, the nearest first, each once."""
    waiting, seen = [link.from_node for link in socket.links], set()
    while waiting:
        node = waiting.pop(0)
        if node.as_pointer() not in seen:
            seen.add(node.as_pointer())
            yield node
            tree = node.node_tree if node.bl_idname == "ShaderNodeGroup" else None
            inside = [each for each in tree.nodes if each.bl_idname == "NodeGroupOutput"] if tree else []
            waiting += [link.from_node for at in (*inside, node) for each in at.inputs for link in each.links]


def _taken(material: Any, shader: Any) -> tuple[Any, float, float]:
    """Return colour, roughness and metallic of the shader of a material, as far as it has them, or as the viewport
    shows it."""
    inputs = {each.name: each for each in shader.inputs} if shader else {}
    color, roughness = inputs.get("Color"), inputs.get("Roughness")
    glossy = bool(shader) and shader.bl_idname in METALS
    return (
        tuple(color.default_value) if color and not color.links else tuple(material.diffuse_color),
        float(roughness.default_value) if glossy and roughness and not roughness.links else 1.0 - glossy * 0.5,
        float(glossy),
    )


def _set_principled(material: Any, color: Any, roughness: float, metallic: float) -> None:
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new("ShaderNodeBsdfPrincipled"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Base Color"].default_value = color
    shader.inputs["Roughness"].default_value, shader.inputs["Metallic"].default_value = roughness, metallic
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
