"""All of Blender's settings that affect a pixel: nothing random, nothing clamped, nothing graded.

Graphics processors: those that Cycles finds, and the one that renders light.
"""

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.renderers.blender.nodes import assign
from spin_usd.renderers.device import DEVICES
from spin_usd.scene.effort import CPU, Effort

TRANSPARENT_BOUNCES = 64  # surfaces one ray may pass through
# Cycles looks at every 16th sample whether a pixel has enough, from this one on. It looks at the light alone, so a dark
# silhouette's coverage is that of 16 samples, without bias (measured); 0 would be Cycles' own guess, 32 to 64.
ADAPTIVE_FROM = 1
LABEL_LAYERS = 1024  # holes that one ray of the labels may pass through: as many as Blender takes

ON_CPU: Mapping[str, Any] = {"device": "CPU"}
CYCLES: Mapping[str, Any] = {
    **ON_CPU,
    "use_denoising": False,
    "sampling_pattern": "TABULATED_SOBOL",
    "use_animated_seed": False,
    "use_sample_subset": False,
    "sample_offset": 0,
    "time_limit": 0.0,
    "tile_size": 8192,
    "scrambling_distance": 1.0,
    "auto_scrambling_distance": False,
    "pixel_filter_type": "BOX",  # the pixel's own square; its width is always 1, whatever filter_width says
    "sample_clamp_direct": 0.0,
    "light_sampling_threshold": 0.0,
    "min_light_bounces": 0,
    "min_transparent_bounces": 0,
    "use_guiding": False,
    "use_fast_gi": False,
    "use_camera_cull": False,
    "use_distance_cull": False,
    "film_exposure": 1.0,
    "debug_bvh_type": "DYNAMIC_BVH",
    "shading_system": False,  # the camera's shader runs without it; it would only move the materials to OSL
    # Nothing that UsdPreviewSurface describes fills a space or refracts: light goes straight through clear surfaces.
    "volume_bounces": 0,
    "transmission_bounces": 0,
}
RENDER: Mapping[str, Any] = {
    "resolution_percentage": 100,
    "use_border": True,
    "use_crop_to_border": True,
    "use_persistent_data": True,
    "use_motion_blur": False,
    "use_compositing": False,
    "use_sequencer": False,
    "use_simplify": False,
    "use_freestyle": False,
    "use_multiview": False,
    "use_stamp": False,
    "use_overwrite": True,
    "use_placeholder": False,
    "use_file_extension": False,
    "film_transparent": True,  # alpha is the target's coverage; the background is composed later
    "dither_intensity": 0.0,
    "threads_mode": "AUTO",
}
EXR: Mapping[str, Any] = {"color_mode": "RGBA", "color_depth": "32", "exr_codec": "NONE"}
IMAGE: Mapping[str, Any] = {"media_type": "IMAGE", "file_format": "OPEN_EXR", **EXR}
LAYERS: Mapping[str, Any] = {"media_type": "MULTI_LAYER_IMAGE", "file_format": "OPEN_EXR_MULTILAYER", **EXR}
LABEL: Mapping[str, Any] = {  # one ray per pixel that stops where it lands; Cycles sends the first through the centre
    **ON_CPU,
    "samples": 1,
    "seed": 0,
    "use_adaptive_sampling": False,
    "max_bounces": 0,
    "diffuse_bounces": 0,
    "glossy_bounces": 0,
    "transparent_max_bounces": 0,
    "use_light_tree": False,
}
Float32 = NDArray[np.float32]

GRAPHICS = tuple(name for name in DEVICES if name != CPU)
MAX_DIFFERENCE, MAX_PIXELS = 0.02, 4.0  # of coverage by the same rays: of itself, and of a target of a few pixels


def cycles_scene() -> Any:
    """Blender's one scene, without a world, rendered by Cycles to linear float EXR."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    assign(scene.cycles, CYCLES)
    assign(scene.render, RENDER)
    assign(scene.render.image_settings, IMAGE)
    assign(scene.view_settings, {"view_transform": "Raw", "look": "None", "exposure": 0.0, "gamma": 1.0})
    scene.world = None  # black; a new world would be grey
    return scene


def cycles_effort(effort: Effort) -> dict[str, Any]:
    """Cycles' own settings for the effort of a picture, except those that also depend on the scene's requirements."""
    adaptive = {"adaptive_threshold": effort.adaptive, "adaptive_min_samples": ADAPTIVE_FROM} if effort.adaptive else {}
    return {
        "samples": effort.samples,
        "max_bounces": effort.bounces,
        "diffuse_bounces": effort.bounces,
        "glossy_bounces": effort.bounces,
        "transparent_max_bounces": TRANSPARENT_BOUNCES,
        "use_adaptive_sampling": bool(effort.adaptive),
        **adaptive,
        "sample_clamp_indirect": effort.clamp,
    }


class LightDevice:
    """The device that renders light.

    Attributes:
        cycles: Cycles' settings that choose it.
        versions: Its model, if not the CPU.
        proven: Whether it is known to see the target as the CPU does.
    """

    def __init__(self, name: str) -> None:
        """Choose the device, a name in DEVICES. Raises UnsupportedError if there is none: Cycles would silently use the
        CPU."""
        self.name = name
        self.cycles: Mapping[str, Any] = {"device": "CPU" if name == CPU else "GPU"}
        self.versions: Mapping[str, str] = {} if name == CPU else {name: _use(name)}
        self.proven = name == CPU

    def prove(self, ours: Float32, theirs: Float32) -> None:
        """Compare the coverage of a picture by the same rays, on the CPU and on this device; arrays of one shape. Where
        a device cannot run a camera's shader, Cycles renders nothing and reports a success. Raises UnsupportedError."""
        differ = float(np.abs(ours - theirs).sum())
        if differ > MAX_DIFFERENCE * float(ours.sum()) + MAX_PIXELS:
            found = f"the device {self.name} does not see the target as the CPU does: {differ:.0f} pixels differ"
            raise UnsupportedError(found, do="choose --device cpu, or another driver")
        self.proven = True


def graphics_processors() -> dict[str, list[str]]:
    """Return the models of graphics processors that Cycles can use, by the name of the device in DEVICES."""
    found = {name: [entry.name for entry in _entries(name)] for name in GRAPHICS}
    return {name: models for name, models in found.items() if models}


def _use(name: str) -> str:
    """Have Cycles use the first graphics processor of that kind, and no other; return its model."""
    entries, preferences = _entries(name), _preferences()
    if not entries:
        do = f"choose --device {' or '.join([*graphics_processors(), CPU])}"
        raise UnsupportedError(f"this machine has no device {name}", do=do)
    assign(preferences, {"compute_device_type": name.upper()})
    for entry in preferences.devices:
        assign(entry, {"use": entry.id == entries[0].id and entry.type == entries[0].type})
    return str(entries[0].name)


def _entries(name: str) -> list[Any]:
    """Return Cycles' own entries of that kind; it lists the CPU beside any."""
    return [entry for entry in _preferences().get_devices_for_type(name.upper()) if entry.type == name.upper()]


def _preferences() -> Any:
    return bpy.context.preferences.addons["cycles"].preferences
