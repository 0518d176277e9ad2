"""Names of USD's prims for what a renderer made in Blender, where people look for them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from spin_usd.renderers.blender.cycles.light_groups import light_name
from spin_usd.renderers.blender.materials.material import FACE_NUMBER, FIRST_NUMBER
from spin_usd.scene.body import Body
from spin_usd.scene.derived.faces import parts_of
from spin_usd.scene.light import DomeLight
from spin_usd.scene.model import Scene


def name_by_prims(blender_scene: Any, scene: Scene, axes: Sequence[Any], camera_path: str) -> None:
    """Name objects, materials and the world by the prims that they stand for; parts become vertex groups. `axes`: the
    object of each of `scene.bodies` in which its surface stands."""
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
    """Name what shows a body by its path, its materials by theirs."""
    path = body.target.path
    surfaces = [shown for shown in blender_scene.objects if shown.parent == axes]
    axes.name, axes.parent.name = f"{path} axes", f"{path} pose"
    for shown in surfaces:
        shown.name = shown.data.name = path
        named = zip(shown.material_slots, body.target.materials, strict=True)
        for slot, material in reversed(list(named)):  # equal surfaces share one: it takes the first's name
            slot.material.name = material.path
        if shown.data.users == 1:
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
