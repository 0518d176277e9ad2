"""A scene as a .blend: plain Blender opens it, and F12 renders the picture before optics and detector."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import RenderError
from spin_usd.renderers.blender.denoiser import own_denoising
from spin_usd.renderers.blender.light_links import light_name
from spin_usd.renderers.blender.material import FACE_NUMBER, FIRST_NUMBER
from spin_usd.renderers.blender.nodes import assign
from spin_usd.renderers.blender.renderer import BlenderRenderer
from spin_usd.renderers.renderer import OpenableScene
from spin_usd.scene.body import Body
from spin_usd.scene.derived.faces import parts_of
from spin_usd.scene.light import DomeLight
from spin_usd.scene.scene import Scene

README = "README"
MAX_STOPS = 32.0  # of the exposure with which Blender shows a picture; it would clamp more in silence
WHOLE_FRAME = {
    "use_border": False,
    "use_crop_to_border": False,
    "use_persistent_data": False,
    "use_file_extension": True,
}
NAME = "behind"
FULL = {"use_compositing": True, "compositor_device": "CPU", "compositor_precision": "FULL"}


class BlendFileWriter:
    """Writes scenes as .blend files, each by a renderer of its own."""

    def write(self, openable: OpenableScene, file: Path) -> None:
        """Write the new `file`, and open it again. Raises RenderError, UnsupportedError."""
        renderer = BlenderRenderer()
        blender_scene, axes = renderer.prepare(openable.scene, openable.effort, seed=openable.seed)
        for other in [each for each in bpy.data.scenes if each != blender_scene]:
            bpy.data.scenes.remove(other)
        name_by_prims(blender_scene, openable.scene, axes, openable.camera_path)
        self._settle(blender_scene, openable)
        if openable.behind is not None:
            lay_behind(blender_scene, openable.behind)
        _pack_images()
        bpy.data.texts.new(README).write("\n".join(openable.readme))
        _save(file)
        renderer.close()

    def _settle(self, blender_scene: Any, openable: OpenableScene) -> None:
        """Set the user's defaults: the whole frame, denoised, and displayed with the detector's brightness."""
        render = blender_scene.render
        assign(render, {**WHOLE_FRAME, "filepath": f"//{openable.scene.frame.name}"})
        assign(blender_scene.cycles, own_denoising(openable.effort))
        blender_scene.view_settings.view_transform = "Standard"
        stops = math.log2(openable.exposure)
        blender_scene.view_settings.exposure = min(max(stops, -MAX_STOPS), MAX_STOPS)
        for screen in bpy.data.screens:
            for area in screen.areas:
                if area.type == "VIEW_3D":
                    area.spaces.active.region_3d.view_perspective = "CAMERA"


def _pack_images() -> None:
    for image in bpy.data.images:
        if image.source == "GENERATED" and image.is_dirty:
            image.pack()


def _save(file: Path) -> None:
    """Save Blender's state, and open it again: Blender reports a success on a full disk."""
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(file), compress=True, copy=True)
        bpy.ops.wm.open_mainfile(filepath=str(file))
    except RuntimeError as error:
        raise RenderError(f"Blender cannot write the file: {error}", do="see whether the disk is full") from error
    if README not in bpy.data.texts:
        raise RenderError("Blender wrote a file that it does not read back", do="see whether the disk is full")


def lay_behind(blender_scene: Any, behind: NDArray[np.float32]) -> None:
    """Let the compositor put the render over `behind` (H, W, 3), W/m2/sr."""
    tree = blender_scene.compositing_node_group = bpy.data.node_groups.new(NAME, "CompositorNodeTree")
    tree.interface.new_socket(name="Image", in_out="OUTPUT", socket_type="NodeSocketColor")
    nodes, link = tree.nodes, tree.links.new
    image, layer, over = (nodes.new(f"CompositorNode{kind}") for kind in ("Image", "RLayers", "AlphaOver"))
    image.image, layer.scene = _image(behind), blender_scene
    link(image.outputs["Image"], over.inputs["Background"])
    link(layer.outputs["Image"], over.inputs["Foreground"])
    link(over.outputs["Image"], nodes.new("NodeGroupOutput").inputs["Image"])
    for column, node in enumerate((image, layer, over, nodes[-1])):
        node.location = (300 * column, 0)
    assign(blender_scene.render, FULL)


def _image(behind: NDArray[np.float32]) -> Any:
    height, width = behind.shape[:2]
    image = bpy.data.images.new(NAME, width, height, alpha=True, float_buffer=True, is_data=True)
    assign(image, {"alpha_mode": "CHANNEL_PACKED", "use_half_precision": False})
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = behind[::-1]
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    return image


def name_by_prims(blender_scene: Any, scene: Scene, axes: Sequence[Any], camera_path: str) -> None:
    """Name objects, materials and the world by their prims; parts become vertex groups. `axes`: the object of each of
    `scene.bodies` that contains its surface."""
    camera = blender_scene.camera
    camera.name = camera.data.name = camera_path
    lights = {light_name(index): light.path for index, light in enumerate(scene.lights)}
    for shown in blender_scene.objects:
        if shown.lightgroup in lights:
            shown.name = shown.data.name = lights[shown.lightgroup]
    for body, its_axes in zip(scene.bodies, axes, strict=True):
        _name_body(blender_scene, body, its_axes)
    _name_world(blender_scene.world, scene)
    for shown in list(blender_scene.objects):
        _keep(blender_scene, shown.parent)


def _name_body(blender_scene: Any, body: Body, axes: Any) -> None:
    """Name the objects of a body by its path, its materials by theirs."""
    path = body.target.path
    surfaces = [shown for shown in blender_scene.objects if shown.parent == axes]
    axes.name, axes.parent.name = f"{path} axes", f"{path} pose"
    for shown in surfaces:
        shown.name = shown.data.name = path
        named = zip(shown.material_slots, body.target.materials, strict=True)
        for slot, material in reversed(list(named)):  # equal surfaces share one: it takes the first's name
            slot.material.name = material.path
        twins = [each for each in blender_scene.objects if each.data == shown.data and each.parent is None]
        for twin in twins:
            twin.name = f"{path} unseen twin"
        if shown.data.users == 1 + len(twins):
            _group_parts(shown, body)


def _group_parts(shown: Any, body: Body) -> None:
    """Make a vertex group of each part; each face has three vertices of its own."""
    numbers = np.empty(len(shown.data.polygons), np.float32)
    shown.data.attributes[FACE_NUMBER].data.foreach_get("value", numbers)
    parts = parts_of(body.target.mesh, (numbers - 1 + shown[FIRST_NUMBER]).astype(np.int64))
    for part in body.target.parts:
        vertices = 3 * np.flatnonzero(parts == part.id)[:, None] + np.arange(3)
        if vertices.size:
            shown.vertex_groups.new(name=part.path).add(vertices.ravel().tolist(), 1.0, "REPLACE")


def _name_world(world: Any, scene: Scene) -> None:
    """Name the world by the domes and planets that shine in it."""
    if world is not None:
        domes = [light.path for light in scene.lights if isinstance(light, DomeLight)]
        world.name = " ".join([*domes, *(planet.path for planet in scene.environment.illuminating)]) or world.name


def _keep(blender_scene: Any, parent: Any) -> None:
    """Link the parents of an object into the scene: a file keeps no others."""
    while parent is not None:
        if parent.name not in blender_scene.collection.objects:
            blender_scene.collection.objects.link(parent)
        parent = parent.parent
