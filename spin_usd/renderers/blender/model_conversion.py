"""Models of the formats that Blender alone reads, FBX and its own, as GLB: what it would render, in metres.

Scripts of a .blend are not run. Files that a model names are taken from below one folder; others are left out, with a
note, before anything is written.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from spin_usd.errors import InputError

GLTF = "io_scene_gltf2"
KEPT = ("ShaderNodeBsdfPrincipled", "ShaderNodeEmission")
"""Shaders that the exporter writes."""
METALS = ("ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfMetallic")
IMAGES = ("ShaderNodeTexImage", "ShaderNodeVertexColor", "ShaderNodeAttribute")


def convert_model(*, source: str, to: str, root: str) -> dict[str, Any]:
    """Write the model at `source` to the GLB `to`; files that it names lie below `root`. Return the length of its unit
    in metres as "metres_per_unit", and "notes". Raises InputError for a file that Blender cannot read."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        if source.lower().endswith(".fbx"):
            bpy.ops.wm.fbx_import(filepath=source, use_anim=False)
        else:
            bpy.ops.wm.open_mainfile(filepath=source, use_scripts=False, load_ui=False)
    except RuntimeError as error:
        said = str(error).strip().removeprefix("Error: ").splitlines()[0]
        raise InputError(f"cannot be read by Blender ({said})", where=source) from None
    _refuse_libraries(source, Path(root))
    notes = list(_without_images_from_elsewhere(Path(source).parent, Path(root)))
    notes += [*_as_rendered(), *_as_principled()]
    for each in bpy.data.objects:
        if each.data is not None and each.data.users == 1:
            each.data.name = each.name  # by which people know a part
    bpy.ops.preferences.addon_enable(module=GLTF)
    bpy.ops.export_scene.gltf(
        filepath=to,
        export_format="GLB",
        export_apply=True,
        export_animations=False,
        export_skins=False,
        export_morph=False,
        export_cameras=False,
        export_lights=False,
        export_yup=False,  # the body axes are those that Blender shows
        export_current_frame=True,
        use_renderable=True,
    )
    unit = bpy.context.scene.unit_settings
    return {"metres_per_unit": float(unit.scale_length), "notes": notes}


def _refuse_libraries(source: str, root: Path) -> None:
    """Raise InputError for a .blend that links another from elsewhere: Blender has opened it already, and what it holds
    must not end in a stage."""
    for library in bpy.data.libraries:
        if not _within(root, Path(bpy.path.abspath(library.filepath))):
            found = f"links {library.filepath}, which lies outside the model's folder"
            raise InputError(found, where=source, do="append it in Blender, or give --root")


def _without_images_from_elsewhere(folder: Path, root: Path) -> Iterator[str]:
    """Remove the images that lie outside `root`, or are not there; yield a note on each."""
    for image in list(bpy.data.images):
        if image.source != "FILE" or image.packed_file:
            continue
        path = Path(bpy.path.abspath(image.filepath, start=str(folder)))
        lost = "lies outside the model's folder" if not _within(root, path) else "is missing"
        if not _within(root, path) or not path.is_file():
            yield f"the texture {path.name!r} {lost}, and was left out"
            bpy.data.images.remove(image)


def _as_rendered() -> Iterator[str]:
    """Make the exporter, which sees what the viewport shows, see what would be rendered; yield a note on what it cannot
    write."""
    shown = set(bpy.context.view_layer.objects)
    copied = {each.instance_collection for each in shown if each.instance_type == "COLLECTION"}
    for collection in _excluded(bpy.context.view_layer.layer_collection):
        for each in collection.objects if collection not in copied else ():
            each.hide_render = each.hide_render or each not in shown
    for each in bpy.data.objects:
        if each.type == "META" and not each.hide_render:
            yield f"the metaball {each.name!r} was left out: convert it to a mesh in Blender"
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
    """Give each material whose surface has no Principled BSDF one, of what can be taken: of others the exporter would
    make white metal. Return a note on each, and on what comes from nodes that no file of others holds."""
    notes = []
    for material in bpy.data.materials:
        name, output = repr(material.name), material.node_tree and material.node_tree.get_output_node("ALL")
        shaders = list(_behind(output.inputs["Surface"])) if output else []
        kept = next((each for each in shaders if each.bl_idname in KEPT), None)
        if kept is None:
            what = str(shaders[0].name) if shaders else "no shader"  # it is gone then
            own = next((each for each in shaders if "Color" in each.inputs), None)
            _set_principled(material, *_taken(material, own))
            notes.append(f"the material {name} has {what}, and no Principled BSDF: only its colour is taken")
        elif kept != shaders[0]:
            notes.append(f"the material {name} has {shaders[0].name}: of its shaders {kept.name} alone is taken")
        elif made := [each.name for each in kept.inputs if each.links and not _has_image(each)]:
            notes.append(f"the material {name} has {', '.join(made)} from nodes, which are left out")
    return notes


def _behind(socket: Any) -> Iterator[Any]:
    """Yield the nodes behind an input, the nearest first, each once."""
    waiting, seen = [link.from_node for link in socket.links], set()
    while waiting:
        node = waiting.pop(0)
        if node.name not in seen:
            seen.add(node.name)
            yield node
            waiting += [link.from_node for each in node.inputs for link in each.links]


def _has_image(socket: Any) -> bool:
    """Return whether an image is behind the input, or colours of the mesh, as the exporter follows them."""
    return any(node.bl_idname in IMAGES for node in _behind(socket))


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


def _within(root: Path, path: Path) -> bool:
    return path.resolve().is_relative_to(root)
