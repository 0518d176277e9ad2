"""Cylinder lights, which Blender lacks: a tube that emits outwards and is invisible otherwise.

Its sides are as many as keep its width within 0.03 % of a cylinder's from every direction, and so wide that the mean
over all directions, its surface, is the cylinder's. Along its length it is in pieces, so that the light tree can
choose those that are near.
"""

from typing import Any

import bpy
import numpy as np

from spin_usd.renderers.blender.lights.lamp_nodes import shaped
from spin_usd.renderers.blender.lights.placement import LightPlacement
from spin_usd.renderers.blender.materials.nodes import Nodes
from spin_usd.scene.light import CylinderLight

SIDES = 128
PIECES = 8


class Tube:
    """One emissive tube."""

    def __init__(self) -> None:
        self.object = bpy.data.objects.new("tube", _unit_tube())
        # Seen by reflections only; it keeps no light from anything.
        self.object.visible_camera = self.object.visible_shadow = False
        self._material: Any = None
        self._blockers: Any = None

    def show(self, light: CylinderLight, place: LightPlacement) -> None:
        """Make it `light`, at `place`."""
        place.move(self.object, (light.length, light.radius, light.radius))
        before, self._material = self._material, _emissive_material(light, place)
        slots = self.object.data.materials
        if before is None:
            slots.append(self._material)
        else:
            slots[0] = self._material
            bpy.data.materials.remove(before)

    def casts_shadows(self, shadows: bool) -> None:
        """Switch the light's shadows. A mesh has no setting for it: without shadows the tube itself is the only blocker
        of its light, and shades nothing."""
        linking = self.object.light_linking
        if self._blockers is None and not shadows:
            self._blockers = bpy.data.collections.new("tube")
            self._blockers.objects.link(self.object)
        if not shadows:
            linking.blocker_collection = self._blockers
        elif linking.blocker_collection == self._blockers:
            linking.blocker_collection = None

    def remove(self) -> None:
        if self._blockers is not None:
            bpy.data.collections.remove(self._blockers)
        if self._material is not None:
            bpy.data.materials.remove(self._material)
        bpy.data.meshes.remove(self.object.data)  # and with it the object


def _unit_tube() -> Any:
    """Return a mesh of length and radius 1 along x, open, its faces outwards."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    radius = np.pi / SIDES / np.sin(np.pi / SIDES)
    along = np.repeat(np.linspace(-0.5, 0.5, PIECES + 1), SIDES)
    around = np.tile(radius * np.stack([np.cos(angle), np.sin(angle)], -1), (PIECES + 1, 1))
    i, j = np.arange(SIDES), (np.arange(SIDES) + 1) % SIDES
    piece = np.stack([i, j, j + SIDES, i + SIDES], -1)
    faces = np.concatenate([piece + k * SIDES for k in range(PIECES)])
    data = bpy.data.meshes.new("tube")
    data.from_pydata(np.column_stack([along, around]).tolist(), [], faces.tolist())
    return data


def _emissive_material(light: CylinderLight, place: LightPlacement) -> Any:
    """Return a material that emits outwards, and is transparent to rays that pass."""
    nodes = Nodes("tube")
    color = shaped(nodes, light.shaping, place.axis, light.emission)
    outside = nodes.math("SUBTRACT", 1.0, nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"])
    emission = nodes.add("ShaderNodeEmission", [color, outside]).outputs[0]
    transparent = nodes.add("ShaderNodeBsdfTransparent").outputs[0]
    material = nodes.surface(nodes.add("ShaderNodeAddShader", [emission, transparent]).outputs[0])
    material.cycles.emission_sampling = "FRONT"
    return material
