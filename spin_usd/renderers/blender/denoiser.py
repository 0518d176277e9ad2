"""Open Image Denoise of whole renders, by Blender's compositor: each light group by itself, in unit light.

Cycles itself denoises only the sum of the groups, and band by band, which leaves seams. The guides are the target's
colours and normals, of the same samples as the light. From CLEAN_FROM samples on they count as free of noise: that
lowers the error (measured), and lets the best quality take a larger network, at a third of the time it takes to clean
them first. With guides of 512 samples instead, the error would be 0 to 4 % lower: they do not pay.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from spin_usd.renderers.blender.cycles_settings import LAYERS
from spin_usd.renderers.blender.nodes import assign
from spin_usd.renderers.blender.passes import Float32, read_picture, render
from spin_usd.scene.effort import Effort
from spin_usd.scene.passes import Radiance

GUIDES = ("Denoising Albedo", "Denoising Normal")
CLEAN_FROM = 16
# Blender's names of the network's size, and of what is done about noisy guides: to clean them first takes longer than
# all the rest, and pays with the largest network only (measured).
QUALITIES = {"fast": ("Fast", "Fast"), "balanced": ("Balanced", "Fast"), "high": ("High", "Accurate")}
CLEAN = "None"  # Blender's name of guides that count as free of noise
MIN_PX = 4  # of Blender's images, a side
COMPOSITOR = {
    "engine": "CYCLES",
    "use_compositing": True,
    "use_sequencer": False,
    "compositor_device": "CPU",
    "compositor_denoise_device": "CPU",
    "compositor_precision": "FULL",
}


def own_denoising(effort: Effort) -> dict[str, Any]:
    """Return Cycles' own settings for denoising the sum of all light: almost like Denoiser."""
    if effort.denoiser == "none":
        return {}
    quality, prefilter = _settings(effort.denoiser, effort.samples)
    return {
        "use_denoising": True,
        "denoiser": "OPENIMAGEDENOISE",
        "denoising_input_passes": "RGB_ALBEDO_NORMAL",
        "denoising_quality": quality.upper(),
        "denoising_prefilter": prefilter.upper(),
        "denoising_use_gpu": False,
    }


class Denoiser:
    """A Blender scene of nothing but a compositor's nodes, which write into the folder `scratch`."""

    def __init__(self, scratch: Path) -> None:
        self._file = scratch / "denoised.exr"
        self._scene = bpy.data.scenes.new("denoiser")
        assign(self._scene.render, COMPOSITOR)
        self._tree = bpy.data.node_groups.new("denoiser", "CompositorNodeTree")
        self._scene.compositing_node_group = self._tree
        self._images: list[Any] = []

    def denoised(self, noisy: Radiance, guides: Float32, quality: str, *, samples: int) -> Radiance:
        """Return `noisy` with each group denoised separately, preserving the total light. The coverage stays, and there
        is no light where it is 0.

        Raises RenderError when Blender fails.

        Args:
            guides: (2, rows, columns, 3): the passes GUIDES.
            samples: Samples of each of their pixels.
        """
        rows, columns = noisy.region.shape
        groups, (albedo, normal) = _large_enough(noisy.groups), _large_enough(guides)
        names = [f"denoised.{index}" for index in range(len(groups))]
        self._build(dict(zip(names, groups, strict=True)), albedo, normal, _settings(quality, samples))
        render(self._scene, self._file, write_still=False)
        shape = (max(rows, MIN_PX), max(columns, MIN_PX))
        found = read_picture(self._file, shape, {name.partition(".")[2]: 3 for name in names})
        clean = np.stack(list(found.values()))[:, :rows, :columns] * (noisy.coverage > 0)[..., None]
        return replace(noisy, groups=_as_bright(clean, noisy.groups))

    def _build(
        self, groups: Mapping[str, Float32], albedo: Float32, normal: Float32, settings: tuple[str, str]
    ) -> None:
        """Make nodes that denoise each of the groups and write it by its name."""
        nodes, link = self._tree.nodes, self._tree.links.new
        nodes.clear()
        stale, self._images = self._images, []
        guides = {"Albedo": self._image(albedo), "Normal": self._image(normal)}
        output = nodes.new("CompositorNodeOutputFile")
        assign(output.format, LAYERS)
        assign(output, {"directory": str(self._file.parent), "file_name": self._file.name, "use_file_extension": False})
        assign(output, {"save_as_render": False})
        for name, group in groups.items():
            node = nodes.new("CompositorNodeDenoise")
            for socket, value in {"HDR": True, "Quality": settings[0], "Prefilter": settings[1]}.items():
                assign(node.inputs[socket], {"default_value": value})
            for socket, source in {"Image": self._image(group), **guides}.items():
                link(source, node.inputs[socket])
            output.file_output_items.new("RGBA", name)
            link(node.outputs["Image"], output.inputs[name])
        for image in stale:  # once the new ones are made: at the same address Blender would take one for the other
            bpy.data.images.remove(image)

    def _image(self, plane: Float32) -> Any:
        """Return the output of a node that shows `plane` (rows, columns, 3)."""
        rows, columns = plane.shape[:2]
        image = bpy.data.images.new("plane", columns, rows, alpha=True, float_buffer=True, is_data=True)
        assign(image, {"alpha_mode": "CHANNEL_PACKED", "use_half_precision": False})
        rgba = np.ones((rows, columns, 4), np.float32)
        rgba[..., :3] = plane[::-1]
        image.pixels.foreach_set(rgba.ravel())
        image.update()
        self._images.append(image)
        node = self._tree.nodes.new("CompositorNodeImage")
        node.image = image
        return node.outputs["Image"]


def _settings(quality: str, samples: int) -> tuple[str, str]:
    """Return Blender's names of the network's size, and of the treatment of guides with that many samples."""
    network, prefilter = QUALITIES[quality]
    return network, CLEAN if samples >= CLEAN_FROM else prefilter


def _as_bright(clean: Float32, noisy: Float32) -> Float32:
    """`clean` (N, rows, columns, 3), each scaled to the total light of `noisy`. The network removes anything that looks
    like noise, such as a target of one pixel; the sum over the target has little noise."""
    before, after = (planes.sum((1, 2, 3), dtype=np.float64) for planes in (noisy, clean))
    factor = np.divide(before, after, out=np.ones_like(before), where=after > 0).astype(np.float32)
    return np.where((after > 0)[:, None, None, None], clean * factor[:, None, None, None], noisy)


def _large_enough(planes: Float32) -> Float32:
    """Return (N, rows, columns, 3) with black rows and columns added: Blender takes an image of one pixel for a
    constant."""
    rows, columns = planes.shape[1:3]
    lacking = (0, max(MIN_PX - rows, 0)), (0, max(MIN_PX - columns, 0))
    return np.pad(planes, ((0, 0), *lacking, (0, 0)))
