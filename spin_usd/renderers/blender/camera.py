"""Blender's camera: a plain perspective if exact, else the camera shader."""

import hashlib
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import _cycles  # type: ignore[import-not-found]
import bpy

from spin_usd.errors import RenderError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.renderers.blender.nodes import assign
from spin_usd.renderers.camera_shader import View

SENSOR_MM = 36.0  # only its ratio to the focal length counts
CLIP_START = 1e-6  # Blender's least, metres
CLIP_SLACK = 2.0


class CameraSetup:
    """The camera of the Blender scene, at its origin."""

    def __init__(self, scene: Any, scratch: Path) -> None:
        self._scene = scene
        self._data = bpy.data.cameras.new("camera")
        self._source = ""
        self._compiled = lru_cache(maxsize=2)(partial(compile_shader, scratch=scratch))  # the labels' and the picture's
        self._object = bpy.data.objects.new("camera", self._data)
        scene.collection.objects.link(self._object)
        scene.camera = self._object

    def aim(self, view: View, *, plain: bool) -> bool:
        """Set the scene's camera to `view`: Blender's own if `plain` and possible. Return whether it is the camera
        shader."""
        render = {"resolution_x": view.camera.width, "resolution_y": view.camera.height}
        assign(self._scene.render, render)
        assign(self._data, {"clip_start": CLIP_START, "clip_end": CLIP_SLACK * view.depth + 2 * CLIP_START})
        shaded = not (plain and self._aim_plain(view.camera))
        if shaded:
            self._aim_shader(view)
        return shaded

    def crop(self, region: Region) -> None:
        """Render only the pixels of `region`."""
        r = self._scene.render
        w, h = r.resolution_x, r.resolution_y
        # Blender truncates its float32 products, so half a pixel is added; its y axis points up.
        border = {
            "border_min_x": (region.x0 + 0.5) / w,
            "border_max_x": (region.x1 + 0.5) / w,
            "border_min_y": (h - region.y1 + 0.5) / h,
            "border_max_y": (h - region.y0 + 0.5) / h,
        }
        assign(r, {name: min(value, 1.0) for name, value in border.items()})

    def _aim_plain(self, camera: Camera) -> bool:
        """Set Blender's own perspective camera; False where Blender cannot hold its numbers."""
        aspect_x, aspect_y = max(camera.fy / camera.fx, 1.0), max(camera.fx / camera.fy, 1.0)
        try:
            assign(self._scene.render, {"pixel_aspect_x": aspect_x, "pixel_aspect_y": aspect_y})
            assign(self._data, {"type": "PERSP", "sensor_fit": "HORIZONTAL", "sensor_width": SENSOR_MM})
            assign(
                self._data,
                {
                    "lens": camera.fx / camera.width * SENSOR_MM,
                    "shift_x": (camera.width / 2 - camera.cx) / camera.width,
                    "shift_y": (camera.cy - camera.height / 2) / camera.width * aspect_y / aspect_x,
                },
            )
        except RenderError:
            return False
        return True

    def _aim_shader(self, view: View) -> None:
        """Set the camera shader, compiled again only where its text changes."""
        source = view.shader
        assign(self._scene.render, {"pixel_aspect_x": 1.0, "pixel_aspect_y": 1.0})
        assign(self._data, {"type": "CUSTOM", "custom_mode": "INTERNAL", "shift_x": 0.0, "shift_y": 0.0})
        if source != self._source:
            bytecode = self._compiled(source)
            self._data.custom_bytecode = bytecode
            self._data.custom_bytecode_hash = hashlib.sha256(bytecode.encode()).hexdigest()[:32]
            self._data.update_tag()
            self._source = source

    def keep_source(self) -> None:
        """Keep the text of the camera shader in Blender too, beside its bytecode: a file of the scene shows it."""
        if self._data.type == "CUSTOM":
            bytecode, digest = self._data.custom_bytecode, self._data.custom_bytecode_hash
            text = bpy.data.texts.new("camera shader")
            text.write(self._source)
            self._data.custom_shader = text
            self._data.custom_bytecode, self._data.custom_bytecode_hash = bytecode, digest


def compile_shader(source: str, scratch: Path) -> str:
    """Bytecode of an OSL shader, through files in the folder `scratch`. Raises RenderError when it does not compile.

    Blender's own way, `Camera.custom_shader`, imports a private OpenImageIO and leaves a file behind each time.
    """
    text, bytecode = scratch / "camera.osl", scratch / "camera.oso"
    text.write_text(source)
    bytecode.unlink(missing_ok=True)
    if not _cycles.osl_compile(str(text), str(bytecode)) or not bytecode.is_file():
        raise RenderError("Blender cannot compile the camera shader", do="see Blender's output above")
    return bytecode.read_text()
