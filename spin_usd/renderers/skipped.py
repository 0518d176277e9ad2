"""The work that a picture does not need: parts of its scene that a path tracer may skip, the reason, and the certainty
that nothing changes.

Only this file decides it: the renderer takes its settings from it, and `plan --explain` lists skipped work and reasons.
A rule must save measurable time, or make a picture more accurate: docs/how-to/speed-against-accuracy.md lists the
savings.
"""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from spin_usd.errors import InputError
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.derived.shown_materials import shown_materials
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import AreaLight, CylinderLight, DistantLight, DomeLight, Light
from spin_usd.scene.scene import Scene

BITS, MEASURED, UNBIASED = "the same bits", "measured to be the same", "nearer to the truth"
GLINTING = 0.1  # radians, angular diameter of a light: a larger one is found often enough by chance
TREE_FROM = 2  # as many lights are chosen among by what they do where they are looked for: a third of the noise


@dataclass(frozen=True, kw_only=True)
class SkippedWork:
    """Work that is skipped."""

    what: str
    """By its short name in RULES."""
    why: str
    same: str
    """BITS, MEASURED or UNBIASED."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Facts:
    """Facts of a scene that determine how it must be rendered, each computed on demand."""

    scene: Scene
    effort: Effort

    @cached_property
    def groups(self) -> LightGroups:
        return LightGroups.of(self.scene)

    @cached_property
    def lights(self) -> tuple[int, ...]:
        """Indices of the lights with a place or a direction that shine on some of the bodies."""
        there, found = {group for body in self.scene.bodies for group in body.target.mesh.groups}, []
        for index in self.groups.placed:
            light = self.scene.lights[index]
            if not isinstance(light, DomeLight) and (light.lights is None or light.lights & there):
                found.append(index)
        return tuple(found)

    @cached_property
    def light_angle(self) -> float:
        """The angular diameter of the smallest light with a place or a direction, as a body sees it, radians."""
        return min((_angle(self.scene.lights[i], self.scene) for i in self.lights), default=np.inf)

    @property
    def tubes(self) -> bool:
        return any(isinstance(self.scene.lights[index], CylinderLight) for index in self.lights)

    @property
    def emissive(self) -> bool:
        """True where a face of some body shines."""
        return any(shown_materials(body.target).emissive for body in self.scene.bodies)


def _angle(light: Light, scene: Scene) -> float:
    """Return the angular diameter of a light, as the body farthest from it sees it, radians; 0 for a point."""
    if isinstance(light, DistantLight):
        return light.angle
    if not isinstance(light, AreaLight) or not light.area:
        return 0.0
    centres = [body.T_cam_body.points(body.target.mesh.centre) for body in scene.bodies]
    far = max(float(np.linalg.norm(light.T_cam_light.translation - centre)) for centre in centres)
    return 2 * math.sqrt(light.facing_area / math.pi) / far


Reason = tuple[str, str] | None
"""Why some work may be skipped and how surely nothing changes; None if it may not."""


def _filter_glossy(facts: Facts) -> Reason:
    if not facts.effort.filter_glossy or facts.light_angle < GLINTING:
        return None
    return "no light is so small that surfaces glint", UNBIASED


def _tree(facts: Facts) -> Reason:
    if not facts.effort.light_tree or len(facts.lights) >= TREE_FROM or facts.tubes or facts.emissive:
        return None
    if facts.lights and facts.groups.surroundings:
        return "there is one light, and the sky", MEASURED
    return "there is nothing to choose among", BITS


def _camera_shader(facts: Facts) -> Reason:
    plain = View.blurred(facts.scene).plain
    return ("the lens is a pinhole's: Blender's own camera keeps to 0.001 px", MEASURED) if plain else None


Rule = Callable[[Facts], Reason]
RULES: Mapping[str, Rule] = MappingProxyType(
    {"glossy filter": _filter_glossy, "light tree": _tree, "camera shader": _camera_shader}
)
"""The rules for work that a renderer may skip, by the names in `BlenderRenderer(keep=...)`."""


def check_rule_names(names: Collection[str]) -> frozenset[str]:
    """Return `names` as names of RULES. Raises InputError for another."""
    for name in names:
        if name not in RULES:
            raise InputError(f"no rule for skipped work is called {name!r}", do=f"choose among {', '.join(RULES)}")
    return frozenset(names)


def skipped_work(facts: Facts, keep: frozenset[str] = frozenset()) -> tuple[SkippedWork, ...]:
    """Return the work that the scene does not need, without the work that is to be kept all the same."""
    found = {name: rule(facts) for name, rule in RULES.items() if name not in keep}
    return tuple(SkippedWork(what=name, why=reason[0], same=reason[1]) for name, reason in found.items() if reason)


@dataclass(frozen=True, kw_only=True, eq=False)
class Requirements:
    """The work that a picture requires, and the work that is `skipped`, with the reasons."""

    skipped: tuple[SkippedWork, ...]
    lights: tuple[int, ...]
    """Indices of those with a place or a direction that shine on some body."""
    light_tree: bool
    """Whether lights are chosen by their effect."""
    filter_glossy: float
    """The effort's filter_glossy, or 0."""
    camera_shader: bool
    """Whether there is one even where a plain camera would do."""

    @classmethod
    def of(cls, scene: Scene, effort: Effort, keep: frozenset[str] = frozenset()) -> "Requirements":
        """Return the requirements of a picture of `scene`. `keep`: names of work to do even if it changes nothing, to
        measure it; it changes no byte that SkippedWork.same does not allow to change."""
        facts = Facts(scene=scene, effort=effort)
        reasons = skipped_work(facts, keep)
        without = {each.what for each in reasons}
        return cls(
            skipped=reasons,
            lights=facts.lights,
            light_tree=effort.light_tree and "light tree" not in without,
            filter_glossy=0.0 if "glossy filter" in without else effort.filter_glossy,
            camera_shader="camera shader" not in without,
        )
