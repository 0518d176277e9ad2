"""Lights with a place as Blender lights, exactly as bright: no falloff is softened, no power guessed.

With `normalize` off, Blender's energy is pi times the radiance of a sphere, disk or rectangle, and pi times the radiant
intensity of a point (measured against the formulas: tests/render/test_lights.py).
"""

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from spin_usd.render.blender.cycles.assign import assign
from spin_usd.render.blender.lights.lamp_nodes import LampNodes, shaped
from spin_usd.render.blender.lights.placement import LightPlacement
from spin_usd.render.blender.materials.nodes import Value
from spin_usd.render.blender.materials.textures import ImageLibrary
from spin_usd.scene.light import AreaLight

KINDS: Mapping[str, str] = {"point": "POINT", "sphere": "POINT", "disk": "AREA", "rect": "AREA"}
"""Blender's kind of light for each shape."""


class Lamp:
    """One Blender light."""

    def __init__(self, kind: str, images: ImageLibrary) -> None:
        self.object = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", kind))
        self._images = images

    def show(self, light: AreaLight, place: LightPlacement) -> None:
        """Make it `light`, at `place`."""
        data = self.object.data
        brightest = max(light.emission)
        color = tuple(value / brightest for value in light.emission)
        assign(data, {"normalize": False, "energy": float(np.pi * brightest), "color": color, **_size(light)})
        place.move(self.object)
        nodes = LampNodes(data)
        nodes.shine(shaped(nodes, light.shaping, place.axis, self._image(nodes, light)))

    def casts_shadows(self, shadows: bool) -> None:
        assign(self.object.data, {"use_shadow": shadows})

    def remove(self) -> None:
        bpy.data.lights.remove(self.object.data)  # and with it the object

    def _image(self, nodes: LampNodes, light: AreaLight) -> Value:
        """What the image multiplies the emission by: upright as seen from the side that is lit, +x to the left."""
        if light.image is None:
            return (1.0, 1.0, 1.0)
        u, v, _ = nodes.add("ShaderNodeSeparateXYZ", [nodes.add("ShaderNodeNewGeometry").outputs["Parametric"]]).outputs
        st = nodes.add("ShaderNodeCombineXYZ", [nodes.math("SUBTRACT", 1.0, u), v]).outputs[0]
        image = self._images.upload(light.image)
        node = nodes.add("ShaderNodeTexImage", [st], image=image, interpolation="Linear", extension="EXTEND")
        return node.outputs["Color"]


def _size(light: AreaLight) -> dict[str, Any]:
    if KINDS[light.shape] == "POINT":
        return {"shadow_soft_size": light.size[0] if light.size else 0.0, "use_soft_falloff": False}
    x, y = light.size if light.shape == "rect" else (2 * light.size[0], 2 * light.size[1])
    shape = "RECTANGLE" if light.shape == "rect" else "ELLIPSE"
    return {"shape": shape, "size": x, "size_y": y, "spread": float(np.pi)}
