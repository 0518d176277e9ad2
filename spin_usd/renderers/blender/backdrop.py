"""What lies behind the bodies, laid there by Blender's compositor: the camera does not see Blender's world."""

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from spin_usd.renderers.blender.cycles.assign import assign

NAME = "behind"
FULL = {"use_compositing": True, "compositor_device": "CPU", "compositor_precision": "FULL"}


def lay_behind(blender_scene: Any, behind: NDArray[np.float32]) -> None:
    """Let the compositor lay what is rendered over `behind` (H, W, 3), W/m2/sr."""
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
