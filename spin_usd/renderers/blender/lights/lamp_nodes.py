"""Nodes for a light's emission by direction, exactly as UsdLux.ShapingAPI defines it.

Blender's own spots fade differently, so their cone is not used.
"""

from typing import Any

import numpy as np

from spin_usd.arrays import Float
from spin_usd.renderers.blender.materials.nodes import Nodes, Value
from spin_usd.scene.light import Shaping


class LampNodes(Nodes):
    """The nodes of a Blender light, which multiply what it emits."""

    def __init__(self, data: Any) -> None:
        self._tree = data.node_tree
        self._tree.nodes.clear()
        self.values = {}

    def shine(self, color: Value) -> None:
        """Finish the light with `color` as the factor of its emission."""
        self.feed(
            self.add("ShaderNodeOutputLight").inputs["Surface"], self.add("ShaderNodeEmission", [color]).outputs[0]
        )


def shaped(nodes: Nodes, shaping: Shaping | None, axis: Float, color: Value) -> Value:
    """`color` times what a light that shines along `axis` (3,), unit, of Blender's world sends to who sees it."""
    if shaping is None:
        return color
    to_viewer = nodes.add("ShaderNodeNewGeometry").outputs["Incoming"]
    node = nodes.add("ShaderNodeVectorMath", [to_viewer, tuple(map(float, axis))], operation="DOT_PRODUCT")
    cosine = node.outputs["Value"]
    if shaping.cone_angle < np.pi or shaping.softness > 0:
        color = nodes.vector("MULTIPLY", color, _cone(nodes, shaping, cosine))
    return nodes.vector("MULTIPLY", color, _focus(nodes, shaping, cosine)) if shaping.focus > 0 else color


def _cone(nodes: Nodes, shaping: Shaping, cosine: Any) -> Value:
    """Return the cone factor: 1 within the cone, 0 beyond, smooth between where it is soft."""
    if shaping.softness == 0:
        return nodes.math("GREATER_THAN", cosine, float(np.cos(shaping.cone_angle)))
    angle = nodes.add("ShaderNodeMath", [cosine], operation="ARCCOSINE").outputs[0]
    start = shaping.cone_angle * (1 - shaping.softness)
    ends = {"From Min": start, "From Max": shaping.cone_angle, "To Min": 1.0, "To Max": 0.0}
    node = nodes.add("ShaderNodeMapRange", {"Value": angle, **ends}, interpolation_type="SMOOTHSTEP")
    return node.outputs["Result"]


def _focus(nodes: Nodes, shaping: Shaping, cosine: Any) -> Value:
    """Return the focus factor: white along the axis, the tint at right angles to it."""
    towards = nodes.add("ShaderNodeMath", [cosine], operation="ABSOLUTE").outputs[0]
    factor = nodes.add("ShaderNodeMath", [towards, shaping.focus], operation="POWER").outputs[0]
    to_white = tuple(1 - tint for tint in shaping.focus_tint)
    return nodes.vector("MULTIPLY_ADD", factor, to_white, shaping.focus_tint)
