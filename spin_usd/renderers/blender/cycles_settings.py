"""Blender's settings, all of those that decide a pixel: nothing random, nothing clamped, nothing graded."""

from collections.abc import Mapping
from typing import Any

import bpy

from spin_usd.renderers.blender.nodes import assign
from spin_usd.scene.effort import Effort

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
    # Nothing that UsdPreviewSurface describes fills a space or refracts: light goes straight through what is clear.
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
    """Cycles' own settings for the effort of a picture, but for those that also depend on what the scene requires."""
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
