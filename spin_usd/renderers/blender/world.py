"""Domes and planets as Blender's world: one image around everything, or one colour.

Cameras do not see it.
"""

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from spin_usd.basics.arrays import Float
from spin_usd.geometry.frames import T_CAM_USDCAM
from spin_usd.renderers.background.surroundings import Surroundings
from spin_usd.renderers.blender.light_links import SURROUNDINGS
from spin_usd.renderers.blender.nodes import assign
from spin_usd.scene.texture import Color

# Blender's latitude-longitude images have +x in their middle column, -y right of it and +z at the top; ours -z, +x, +y.
TO_BLENDER = np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])
# Of the map by which Cycles chooses directions, up to which it is twice as fine as the image: so it misses no texel's
# bilinear slopes. Each change of image or camera makes it again, which takes 0.1 s at this width.
FINE_MAP_WIDTH = 1024


class WorldSetup:
    """The world of one Blender scene; it is absent where nothing shines from afar."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._world: Any = None
        self._key = ""
        self.image = ""
        """The digest of the image that shines, "" while none does."""
        self._turned = np.zeros((3, 3))

    def set_light(self, surroundings: Surroundings | None) -> None:
        """Show these surroundings, or no world if there are none. Rays are sent to bright regions unless it is
        uniform."""
        self.image = surroundings.key if surroundings and surroundings.uniform is None else ""
        if surroundings is None:
            self._show(None)
            return
        if self._world is None:
            self._make_world()
        self._show(self._world)
        if surroundings.key != self._key:
            self._paint(surroundings)
            self._key = surroundings.key
        assign(self._world.cycles, {"sampling_method": "MANUAL" if surroundings.uniform is None else "NONE"})
        self._turn(surroundings.rotation)

    def _show(self, world: Any) -> None:
        """Assign the world only if it has changed: Cycles prepares any assigned world anew."""
        if self._scene.world != world:
            self._scene.world = world

    def _make_world(self) -> None:
        self._world = bpy.data.worlds.new("surroundings")
        self._show(self._world)  # before its settings, which look for it there
        assign(self._world.cycles_visibility, {"camera": False})
        assign(self._world, {"lightgroup": SURROUNDINGS})
        nodes, link = self._world.node_tree.nodes, self._world.node_tree.links.new
        nodes.clear()
        direction = nodes.new("ShaderNodeTexCoord")
        self._mapping = nodes.new("ShaderNodeMapping")
        self._texture = nodes.new("ShaderNodeTexEnvironment")
        self._background = nodes.new("ShaderNodeBackground")
        output = nodes.new("ShaderNodeOutputWorld")
        assign(self._mapping, {"vector_type": "POINT"})
        assign(self._texture, {"projection": "EQUIRECTANGULAR", "interpolation": "Linear"})
        link(direction.outputs["Generated"], self._mapping.inputs["Vector"])
        link(self._mapping.outputs["Vector"], self._texture.inputs["Vector"])
        link(self._background.outputs["Background"], output.inputs["Surface"])

    def _paint(self, surroundings: Surroundings) -> None:
        if surroundings.uniform is not None:
            self._paint_uniform(surroundings.uniform)
        else:
            self._paint_image(surroundings)

    def _paint_uniform(self, radiance: Color) -> None:
        self._replace_image(None)
        strength = max(radiance) or 1.0
        self._background.inputs["Color"].default_value = (*(channel / strength for channel in radiance), 1.0)
        assign(self._background.inputs["Strength"], {"default_value": strength})
        assign(self._world.cycles, {"sample_map_resolution": FINE_MAP_WIDTH})

    def _paint_image(self, surroundings: Surroundings) -> None:
        self._replace_image(_image(surroundings))
        assign(self._background.inputs["Strength"], {"default_value": 1.0})
        self._world.node_tree.links.new(self._texture.outputs["Color"], self._background.inputs["Color"])
        width = surroundings.pixels.shape[1]
        assign(self._world.cycles, {"sample_map_resolution": min(2 * width, max(width, FINE_MAP_WIDTH))})

    def _replace_image(self, image: Any) -> None:
        """Show `image`, or none, and free the one before.

        After the new one is made: at the same address Blender would take it for the old one.
        """
        for link in list(self._background.inputs["Color"].links):
            self._world.node_tree.links.remove(link)
        old, self._texture.image = self._texture.image, image
        if old:
            bpy.data.images.remove(old)

    def _turn(self, rotation: Float) -> None:
        """rotation (3, 3): from the image's axes to the camera's."""
        turn = TO_BLENDER @ rotation.T @ T_CAM_USDCAM.rotation
        if not np.array_equal(turn, self._turned):
            assign(self._mapping.inputs["Rotation"], {"default_value": tuple(Matrix(turn).to_euler("XYZ"))})
            self._turned = turn


def _image(surroundings: Surroundings) -> Any:
    height, width = surroundings.pixels.shape[:2]
    image = bpy.data.images.new("surroundings", width, height, alpha=True, float_buffer=True, is_data=True)
    assign(image, {"alpha_mode": "CHANNEL_PACKED", "use_half_precision": False})
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = surroundings.pixels[::-1]
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    return image
