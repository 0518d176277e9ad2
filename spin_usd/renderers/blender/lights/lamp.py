"""Lights with a place as Blender lights, exactly as bright: no falloff is softened, no power guessed.

With `normalize` off, Blender's energy is pi times the radiance of a sphere, disk or rectangle, and pi times the radiant
intensity of a point (measured against the formulas: tests/renderers/blender/lights/test_lights.py).
"""

import math
from typing import Any

import bpy
import numpy as np

from spin_usd.errors import UnsupportedError
from spin_usd.renderers.blender.cycles.assign import assign
from spin_usd.renderers.blender.lights.lamp_nodes import LampNodes, shaped
from spin_usd.renderers.blender.lights.placement import LightPlacement
from spin_usd.renderers.blender.materials.nodes import Value
from spin_usd.renderers.blender.materials.textures import ImageLibrary
from spin_usd.scene.light import AreaLight, DiskLight, PointLight, RectLight, SphereLight


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
        """Return the factor of the emission by the light's image, which is upright as seen from the side that is lit,
        +x to the left."""
        if not isinstance(light, RectLight) or light.image is None:
            return (1.0, 1.0, 1.0)
        u, v, _ = nodes.add("ShaderNodeSeparateXYZ", [nodes.add("ShaderNodeNewGeometry").outputs["Parametric"]]).outputs
        st = nodes.add("ShaderNodeCombineXYZ", [nodes.math("SUBTRACT", 1.0, u), v]).outputs[0]
        image = self._images.upload(light.image)
        node = nodes.add("ShaderNodeTexImage", [st], image=image, interpolation="Linear", extension="EXTEND")
        return node.outputs["Color"]


def _size(light: AreaLight) -> dict[str, Any]:
    """Blender's settings for the shape and size of `light`."""
    match light:
        case PointLight():
            return {"shadow_soft_size": 0.0, "use_soft_falloff": False}
        case SphereLight(radius=radius):
            return {"shadow_soft_size": radius, "use_soft_falloff": False}
        case DiskLight(radius_x=x, radius_y=y):
            return {"shape": "ELLIPSE", "size": 2 * x, "size_y": 2 * y, "spread": math.pi}
        case RectLight(width=width, height=height):
            return {"shape": "RECTANGLE", "size": width, "size_y": height, "spread": math.pi}
    raise UnsupportedError(f"is a {light.shape}, which Blender has no light for", where=light.path)
