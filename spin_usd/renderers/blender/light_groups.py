"""Light groups in Blender: each light's share of the picture in a pass of its own, by the name of its group."""

from collections.abc import Sequence
from typing import Any

from spin_usd.renderers.blender.passes import COMBINED
from spin_usd.scene.derived.light_groups import LightGroups

SURROUNDINGS, EMISSION = "surroundings", "emission"


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


def pass_names(names: Sequence[str], *, apart: bool) -> list[str]:
    """Return the passes that hold these groups: where they are not `apart`, the only one is the picture itself."""
    return [f"{COMBINED}_{name}" for name in names] if apart else [COMBINED] * len(names)


def keep_apart(layer: Any, names: Sequence[str]) -> None:
    """Let the view layer render these groups apart."""
    if [group.name for group in layer.lightgroups] == list(names):
        return
    while len(layer.lightgroups):
        layer.lightgroups.remove(layer.lightgroups[0])
    for name in names:
        layer.lightgroups.add(name=name)
