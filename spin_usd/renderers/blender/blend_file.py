"""A scene as a .blend: plain Blender opens it, and F12 renders what lies before optics and detector."""

import math
from pathlib import Path
from typing import Any

import bpy

from spin_usd.errors import RenderError
from spin_usd.renderers.blender.backdrop import lay_behind
from spin_usd.renderers.blender.cycles.assign import assign
from spin_usd.renderers.blender.cycles.denoiser import own_denoising
from spin_usd.renderers.blender.prim_names import name_by_prims
from spin_usd.renderers.blender.renderer import BlenderRenderer
from spin_usd.renderers.renderer import OpenableScene

README = "README"
MAX_STOPS = 32.0  # of the exposure with which Blender shows a picture; it would clamp more in silence
WHOLE_FRAME = {
    "use_border": False,
    "use_crop_to_border": False,
    "use_persistent_data": False,
    "use_file_extension": True,
}


class BlendFileWriter:
    """Writes scenes as .blend files, each by a renderer of its own."""

    def write(self, openable: OpenableScene, file: Path) -> None:
        """Write the new `file`, and open it again. Raises RenderError, UnsupportedError."""
        renderer = BlenderRenderer(keep=("shading",))  # a dark scene shows its materials too
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
        """Set what a person expects of a file: the whole frame, denoised, and shown as bright as the detector does."""
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
