"""The lights of a scene as Blender's: kept from frame to frame, touched only where they changed."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy

from spin_usd.renderers.blender.cycles.light_groups import light_name
from spin_usd.renderers.blender.lights.lamp import Lamp
from spin_usd.renderers.blender.lights.light_check import refuse_clamped
from spin_usd.renderers.blender.lights.light_links import LightLinking, chosen
from spin_usd.renderers.blender.lights.placement import LightPlacement
from spin_usd.renderers.blender.lights.sun import Sun
from spin_usd.renderers.blender.lights.tube import Tube
from spin_usd.renderers.blender.materials.textures import ImageLibrary
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.content import key_of
from spin_usd.scene.light import AreaLight, CylinderLight, DistantLight, Light, PointLight, RectLight, SphereLight


@dataclass(eq=False)
class BlenderLight:
    """A light in Blender: the `source` object, its links, and the key of the light that it shows now."""

    source: Sun | Lamp | Tube
    links: LightLinking
    key: str = ""


class LightSetup:
    """The Suns, lamps and tubes that one Blender scene needs. Domes belong to the world."""

    def __init__(self, scene: Any) -> None:
        self._scene = scene
        self._parent = bpy.data.objects.new("lights", None)
        self._images = ImageLibrary()
        self._shown: list[BlenderLight] = []
        self._kinds: list[str] = []
        self._groups: list[int] = []
        self.made = 0
        """How often its lights were made anew."""

    def shine(
        self,
        lights: Sequence[Light],
        shining: Collection[int],
        view: View,
        groups: Mapping[int, Sequence[Any]],
        *,
        shadows: bool,
    ) -> None:
        """Make the scene's lights those of `lights` with the indices `shining`, for a target whose face groups are
        these objects; `shadows`: those that cast any cast them."""
        placed = {i: light for i, light in enumerate(lights) if isinstance(light, (DistantLight, AreaLight))}
        for light in placed.values():
            refuse_clamped(light)
        shining = {i: placed[i] for i in shining}
        self._provide(
            [_kind(light) for light in shining.values()],
            [each.as_pointer() for shown in groups.values() for each in shown],
        )
        for shown, (i, light) in zip(self._shown, shining.items(), strict=True):
            self._show(shown, light, view, groups, shadows=shadows)
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
        *,
        shadows: bool,
    ) -> None:
        linked = [(group, [each.as_pointer() for each in shown]) for group, shown in groups.items()]
        key = key_of([light, view.centre if isinstance(light, AreaLight) else None, view.near, linked, shadows])
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
        shown.source.casts_shadows(shadows and light.shadows and chosen(light.shadowed_by, groups) != [])
        shown.key = key


def _kind(light: DistantLight | AreaLight) -> str:
    """Blender's kind of light; a TUBE is our own."""
    if isinstance(light, DistantLight):
        return "SUN"
    if isinstance(light, CylinderLight):
        return "TUBE"
    return "POINT" if isinstance(light, (PointLight, SphereLight)) else "AREA"
