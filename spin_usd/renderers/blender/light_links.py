"""Light linking of Blender: a collection of the objects that a light illuminates, and one of the objects that cast its
shadows.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import bpy

from spin_usd.renderers.blender.passes import COMBINED
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.light import AreaLight, DistantLight, Light, Links

RECEIVERS, BLOCKERS = "receiver_collection", "blocker_collection"
SURROUNDINGS, EMISSION = "surroundings", "emission"


def needs_groups(lights: Sequence[Light]) -> bool:
    """Return whether a light illuminates, or is shadowed by, only a part of the target."""
    linked = (light for light in lights if isinstance(light, (AreaLight, DistantLight)))
    return any(light.lights is not None or light.shadowed_by is not None for light in linked)


class LightLinking:
    """The links of one Blender light or tube."""

    def __init__(self, shown: Any) -> None:
        self._shown = shown
        self._collections: dict[str, Any] = {}

    def link(self, light: DistantLight | AreaLight, groups: Mapping[int, Sequence[Any]]) -> None:
        """Let it illuminate the same objects as `light`. Blender ignores an empty collection: such lights are not
        shown, and cast no shadows."""
        self._fill(RECEIVERS, chosen(light.lights, groups))
        self._fill(BLOCKERS, chosen(light.shadowed_by, groups) if light.shadows else None)

    def remove(self) -> None:
        for collection in self._collections.values():
            bpy.data.collections.remove(collection)

    def _fill(self, kind: str, objects: Iterable[Any] | None) -> None:
        """Let the collection of `kind` hold these objects; None for no such collection."""
        before = self._collections.pop(kind, None)
        if before is not None:
            bpy.data.collections.remove(before)
        if objects is not None:
            made = self._collections[kind] = bpy.data.collections.new(kind)
            for shown in objects:
                made.objects.link(shown)
            setattr(self._shown.light_linking, kind, made)


def chosen(links: Links, groups: Mapping[int, Sequence[Any]]) -> list[Any] | None:
    """Return the objects of the groups that `links` names; None for all of them."""
    if links is None or links >= set(groups):
        return None
    return [each for group, shown in groups.items() if group in links for each in shown]


def light_name(index: int) -> str:
    """Return the group of the light at this place of Scene.lights."""
    return f"light {index}"


def group_names(groups: LightGroups) -> list[str]:
    """Return the names of a scene's groups, in their order."""
    names = [light_name(index) for index in groups.placed]
    if groups.surroundings:
        names.append(SURROUNDINGS)
    if groups.emission:
        names.append(EMISSION)
    return names


def pass_name(group: str) -> str:
    """Return the pass that holds this group."""
    return f"{COMBINED}_{group}"


def keep_apart(layer: Any, names: Sequence[str]) -> None:
    """Let the view layer render these groups apart."""
    if [group.name for group in layer.lightgroups] == list(names):
        return
    while len(layer.lightgroups):
        layer.lightgroups.remove(layer.lightgroups[0])
    for name in names:
        layer.lightgroups.add(name=name)
