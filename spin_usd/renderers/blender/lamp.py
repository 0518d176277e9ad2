"""The lights of a scene as Blender's own, exactly as bright: no falloff is softened, no power guessed."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import UnsupportedError
from spin_usd.geometry.frames import T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.blender.light_links import LightLinking, chosen, light_name
from spin_usd.renderers.blender.nodes import Nodes, Value, assign, assign_matrix
from spin_usd.renderers.blender.textures import ImageLibrary
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.content import key_of
from spin_usd.scene.light import (
    AreaLight,
    CylinderLight,
    DiskLight,
    DistantLight,
    Light,
    PointLight,
    RectLight,
    Shaping,
    SphereLight,
)

MAX_ANGLE = 3.0  # radians; Blender clamps a little above
SIDES = 128
PIECES = 8


class LampNodes(Nodes):
    """The nodes of a Blender light, which multiply its emission."""

    def __init__(self, data: Any) -> None:
        self._tree = data.node_tree
        self._tree.nodes.clear()
        self.values = {}

    def set_light(self, color: Value) -> None:
        """Finish the light with `color` as the factor of its emission."""
        self.feed(
            self.add("ShaderNodeOutputLight").inputs["Surface"], self.add("ShaderNodeEmission", [color]).outputs[0]
        )


def shaped(nodes: Nodes, shaping: Shaping | None, axis: Float, color: Value) -> Value:
    """Return `color` times the emission towards the viewer of a light that shines along `axis` (3,), unit, in Blender's
    world.

    It is exactly as UsdLux.ShapingAPI defines it. Blender's own spots fade differently, so their cone is not used.
    """
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


@dataclass(frozen=True, kw_only=True, eq=False)
class LightPlacement:
    """The place of a light in Blender's world."""

    rotation: Float
    """(3, 3) of the axes."""
    location: Float
    """(3,) of the axes, metres."""
    parent: Any
    """The parent of all objects that have one."""

    @classmethod
    def of(cls, T_cam: Transform, view: View, parent: Any) -> "LightPlacement":
        """Return the placement of the axes T_cam in `view`, by doubles relative to the target's centre: far away
        Blender's world has its origin there."""
        location = T_USDCAM_CAM.points(T_cam.translation - view.centre) + view.location(view.centre)
        return cls(rotation=T_USDCAM_CAM.rotation @ T_cam.rotation, location=location, parent=parent)

    @property
    def axis(self) -> Float:
        """(3,) unit, along which a light here shines: its -z."""
        return -self.rotation[:, 2]

    def move(self, shown: Any, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> None:
        """Place an object here, `scale` times as large along its own axes."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation * scale, self.location
        shown.parent = self.parent
        assign_matrix(shown, matrix)


class Tube:
    """One emissive tube, for a cylinder light, which Blender lacks: it emits outwards and is invisible otherwise."""

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
    """Return a mesh of length and radius 1 along x, open, its faces outwards.

    Its SIDES are as many as keep its width within 0.03 % of a cylinder's from every direction. They are so wide that
    the mean width over all directions, hence the surface, is the cylinder's. It has PIECES along its length, so that
    the light tree can choose those that are near.
    """
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


class Lamp:
    """One Blender light that has a place.

    With `normalize` off, Blender's energy is pi times the radiance of a sphere, disk or rectangle, and pi times the
    radiant intensity of a point (measured against the formulas: tests/renderers/blender/test_lights.py).
    """

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
        nodes.set_light(shaped(nodes, light.shaping, place.axis, self._image(nodes, light)))

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


class Sun:
    """One Blender Sun; `parent` is the parent of all lights."""

    def __init__(self, parent: Any) -> None:
        self._parent = parent
        self.object = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))

    def show(self, light: DistantLight) -> None:
        """Make it `light`."""
        energy = max(light.at_target)
        color = tuple(value / energy for value in light.at_target)
        assign(self.object.data, {"energy": energy, "color": color, "angle": light.angle})
        rotation = shining_along(T_USDCAM_CAM.directions(light.direction_cam))
        LightPlacement(rotation=rotation, location=np.zeros(3), parent=self._parent).move(self.object)

    def casts_shadows(self, shadows: bool) -> None:
        assign(self.object.data, {"use_shadow": shadows})

    def remove(self) -> None:
        bpy.data.lights.remove(self.object.data)  # and with it the object


def shining_along(direction: Float) -> Float:
    """Return a rotation matrix (3, 3) that takes -z, along which a Blender Sun shines, to the unit `direction`."""
    z = -np.asarray(direction, np.float64)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], -1)


@dataclass(eq=False)
class BlenderLight:
    """A light in Blender."""

    source: Sun | Lamp | Tube
    """The object."""
    links: LightLinking
    key: str = ""
    """The key of the light that it shows now."""


class LightSetup:
    """The Suns, lamps and tubes that one Blender scene needs; domes belong to the world.

    They are kept from frame to frame, and touched only where they changed.
    """

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._parent = bpy.data.objects.new("lights", None)
        self._images = ImageLibrary()
        self._shown: list[BlenderLight] = []
        self._kinds: list[str] = []
        self._groups: list[int] = []
        self.made = 0
        """How often its lights were made anew."""

    def set_light(
        self,
        lights: Sequence[Light],
        shining: Collection[int],
        view: View,
        groups: Mapping[int, Sequence[Any]],
    ) -> None:
        """Make the scene's lights those of `lights` with the indices `shining`, for a target whose face groups are
        these objects."""
        placed = {i: light for i, light in enumerate(lights) if isinstance(light, (DistantLight, AreaLight))}
        for light in placed.values():
            refuse_clamped(light)
        shining = {i: placed[i] for i in shining}
        self._provide(
            [_kind(light) for light in shining.values()],
            [each.as_pointer() for shown in groups.values() for each in shown],
        )
        for shown, (i, light) in zip(self._shown, shining.items(), strict=True):
            self._show(shown, light, view, groups)
            shown.source.object.lightgroup = light_name(i)
        images = (light.image for light in shining.values() if isinstance(light, RectLight))
        self._images.keep_only({image.key for image in images if image})

    def _provide(self, kinds: list[str], groups: list[int]) -> None:
        """Have these kinds of lights, in this order, made after the target's objects: the order decides which random
        number chooses which, so it must not depend on what was shown before."""
        if kinds == self._kinds and (groups == self._groups or "TUBE" not in kinds):
            return
        for shown in self._shown:
            shown.links.remove()
            shown.source.remove()
        sources = [self._new(kind) for kind in kinds]
        for source in sources:
            self._scene.collection.objects.link(source.object)
        self._shown = [BlenderLight(source=source, links=LightLinking(source.object)) for source in sources]
        self._kinds, self._groups = kinds, groups
        self.made += 1

    def _new(self, kind: str) -> Sun | Lamp | Tube:
        if kind == "SUN":
            return Sun(self._parent)
        return Tube() if kind == "TUBE" else Lamp(kind, self._images)

    def _show(
        self,
        shown: BlenderLight,
        light: DistantLight | AreaLight,
        view: View,
        groups: Mapping[int, Sequence[Any]],
    ) -> None:
        linked = [(group, [each.as_pointer() for each in shown]) for group, shown in groups.items()]
        key = key_of([light, view.centre if isinstance(light, AreaLight) else None, view.near, linked])
        if key == shown.key:
            return
        shown.key = ""
        match shown.source, light:
            case Sun() as sun, DistantLight() as distant:
                sun.show(distant)
            case Tube() as tube, CylinderLight() as cylinder:
                tube.show(cylinder, LightPlacement.of(cylinder.T_cam_light, view, self._parent))
            case Lamp() as lamp, AreaLight() as area:
                lamp.show(area, LightPlacement.of(area.T_cam_light, view, self._parent))
        shown.links.link(light, groups)
        shown.source.casts_shadows(light.shadows and chosen(light.shadowed_by, groups) != [])
        shown.key = key


def _kind(light: DistantLight | AreaLight) -> str:
    """Blender's kind of light; a TUBE is our own."""
    if isinstance(light, DistantLight):
        return "SUN"
    if isinstance(light, CylinderLight):
        return "TUBE"
    return "POINT" if isinstance(light, (PointLight, SphereLight)) else "AREA"


def refuse_clamped(light: DistantLight | AreaLight) -> None:
    """Raise UnsupportedError, with the light's path, for a light that cannot be rendered as intended."""
    if isinstance(light, DistantLight):
        _check_color(light.irradiance, "irradiance", light.path)
        _check_distant(light)
    else:
        _check_color(light.emission, "emission", light.path)
        _check_area(light)


def _check_color(color: tuple[float, float, float], name: str, path: str) -> None:
    if not np.isfinite(color).all() or min(color) < 0:
        do = "make it finite and not negative"
        raise UnsupportedError(f"its {name} is {color}", where=path, do=do)


def _check_distant(light: DistantLight) -> None:
    if not 0 <= light.angle <= MAX_ANGLE:
        do = f"keep it between 0 and {np.degrees(MAX_ANGLE):.4g} degrees, or use a DomeLight"
        raise UnsupportedError(f"its angle is {np.degrees(light.angle):.4g} degrees", where=light.path, do=do)
    if abs(float(np.linalg.norm(light.direction_cam)) - 1) > 1e-6:
        found = f"its direction {light.direction_cam} is not of unit length"
        raise UnsupportedError(found, where=light.path, do="divide it by its length")


def _check_area(light: AreaLight) -> None:
    if not all(np.isfinite(length) and length > 0 for length in light.size):
        raise UnsupportedError(f"its size is {light.size}", where=light.path, do="make it finite and above 0")
