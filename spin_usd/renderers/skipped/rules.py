"""The work that a scene does not need: rule by rule, what may be skipped, why, and how surely nothing changes."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from spin_usd.errors import InputError
from spin_usd.renderers.camera_shader import View
from spin_usd.renderers.skipped.facts import Facts

BITS, ROUNDING, MEASURED = "the same bits", "the same but for rounding", "measured to be the same"
UNBIASED = "nearer to the truth"
DARK_ENOUGH = 1e-4  # of the light reflected once, that bounces may hold that are skipped
STILL_PX = 1e-3  # blur that no picture shows: a pixel's rays go through one of 65,536 places a side
GLINTING = 0.1  # radians, angular diameter of a light: a larger one is found often enough by chance
TREE_FROM = 2  # as many lights are chosen among by what they do where they are looked for: a third of the noise


@dataclass(frozen=True, kw_only=True)
class SkippedWork:
    """Work that is skipped: `what` by its short name in RULES; `same`: BITS, ROUNDING, MEASURED or UNBIASED."""

    what: str
    why: str
    same: str


Reason = tuple[str, str] | None
"""Why some work may be skipped and how surely nothing changes; None where it may not."""


def late_bounces(facts: Facts) -> int:
    """Return the number of bounces that hold all but DARK_ENOUGH of the light, at most those asked for.

    A surface passes on at most its albedo of what it gets, so what comes after n bounces is at most
    albedo^(n + 1) + albedo^(n + 2) + ... of the light that is reflected once.
    """
    albedo = facts.surfaces.albedo if facts.surfaces.diffuse else 1.0
    most = facts.effort.bounces
    if not albedo < 1:
        return most
    return next((n for n in range(most) if albedo ** (n + 1) / (1 - albedo) <= DARK_ENOUGH), most)


def _shading(facts: Facts) -> Reason:
    return ("no light reaches the target", BITS) if facts.dark and not facts.surfaces.transparent else None


def _bounces(facts: Facts) -> Reason:
    if not facts.effort.bounces or not facts.alone:
        return None
    return "the target is convex: light that leaves it never meets it again", BITS


def _late_bounces(facts: Facts) -> Reason:
    kept = late_bounces(facts)
    if kept == facts.effort.bounces:
        return None
    return (
        f"at an albedo of {facts.surfaces.albedo:.2g} they hold at most {DARK_ENOUGH:g} of what is reflected once",
        MEASURED,
    )


def _glossy(facts: Facts) -> Reason:
    return ("all materials are diffuse", BITS) if facts.surfaces.diffuse and facts.effort.bounces else None


def _filter_glossy(facts: Facts) -> Reason:
    if not facts.effort.filter_glossy:
        return None
    if facts.surfaces.diffuse:
        return "all materials are diffuse", BITS
    if facts.alone or not facts.effort.bounces:
        return "no light reaches the camera by way of two surfaces", BITS
    return None if facts.light_angle < GLINTING else ("no light is so small that surfaces glint", UNBIASED)


def _transmission(facts: Facts) -> Reason:
    return ("nothing refracts: transparent surfaces let light straight through", BITS) if facts.effort.bounces else None


def _volumes(_: Facts) -> Reason:
    return "nothing that UsdPreviewSurface describes fills a space", BITS


def _transparent(facts: Facts) -> Reason:
    return None if facts.surfaces.transparent or facts.lamps else ("nothing is transparent or cut out", BITS)


def _tree(facts: Facts) -> Reason:
    if not facts.effort.light_tree or len(facts.lights) >= TREE_FROM or facts.tubes:
        return None
    if facts.surfaces.emissive and not facts.alone:
        return None
    if facts.lights and facts.groups.surroundings:
        return "there is one light, and the sky", MEASURED
    return "there is nothing to choose among", BITS


def _shadows(facts: Facts) -> Reason:
    if not facts.lights or not facts.alone or facts.surfaces.normal_mapped or facts.tubes:
        return None
    return "the target is convex and its faces flat: none is in another's light", BITS


def _emitters(facts: Facts) -> Reason:
    if not facts.surfaces.emissive or not facts.alone:
        return None
    return "the target is convex: its own light never falls on it", MEASURED


def _world(facts: Facts) -> Reason:
    return None if facts.groups.surroundings else ("no dome and no planet shines on the target", BITS)


def _world_sampling(facts: Facts) -> Reason:
    if facts.surroundings is None or facts.surroundings.uniform is None:
        return None
    return "the sky is the same from everywhere", BITS


def _depth_of_field(facts: Facts) -> Reason:
    if facts.scene.thin_lens is None or facts.defocus_px > STILL_PX:
        return None
    return f"it blurs the target by at most {STILL_PX:g} px", MEASURED


def _motion_blur(facts: Facts) -> Reason:
    if facts.scene.shutter is None or facts.motion_px > STILL_PX:
        return None
    return f"the target moves by at most {STILL_PX:g} px", MEASURED


def _camera_shader(facts: Facts) -> Reason:
    view = View.blurred(facts.scene)
    plain = (replace(view, thin_lens=None) if _depth_of_field(facts) else view).plain
    return ("the lens is a pinhole's: Blender's own camera keeps to 0.001 px", MEASURED) if plain else None


def _light_groups(facts: Facts) -> Reason:
    return ("all light is of one group", ROUNDING) if facts.groups.count == 1 else None


def _inputs(facts: Facts) -> Reason:
    idle = facts.surfaces.idle
    return (f"of some materials these change nothing: {', '.join(idle)}", ROUNDING) if idle else None


def _unseen(facts: Facts) -> Reason:
    count = sum(len(each.unseen) for each in facts.surfaces.each)
    every = sum(len(each.materials) for each in facts.surfaces.each)
    return (f"{count} of {every} are on no face", BITS) if count else None


def _primvars(facts: Facts) -> Reason:
    each = facts.surfaces.each
    unread = sorted(frozenset().union(*(one.target.mesh.primvar_names - one.primvars for one in each)))
    return (f"no material reads {', '.join(unread)}", BITS) if unread else None


Rule = Callable[[Facts], Reason]
RULES: Mapping[str, Rule] = MappingProxyType(
    {
        "shading": _shading,
        "bounces": _bounces,
        "late bounces": _late_bounces,
        "glossy bounces": _glossy,
        "glossy filter": _filter_glossy,
        "transmission bounces": _transmission,
        "volumes": _volumes,
        "transparent layers": _transparent,
        "light tree": _tree,
        "shadow rays": _shadows,
        "emissive faces as lights": _emitters,
        "world": _world,
        "world sampling": _world_sampling,
        "depth of field": _depth_of_field,
        "motion blur": _motion_blur,
        "camera shader": _camera_shader,
        "light groups": _light_groups,
        "material inputs": _inputs,
        "unseen materials": _unseen,
        "primvars": _primvars,
    }
)
"""The rules for work that a renderer may skip, by name. The names are those of `BlenderRenderer(keep=...)`."""


def check_rule_names(names: Collection[str]) -> frozenset[str]:
    """`names` as those of RULES. Raises InputError for another."""
    for name in names:
        if name not in RULES:
            raise InputError(f"no rule for skipped work is called {name!r}", do=f"choose among {', '.join(RULES)}")
    return frozenset(names)


def skipped_work(facts: Facts, keep: frozenset[str] = frozenset()) -> tuple[SkippedWork, ...]:
    """Return the work that the scene does not need, without the work that is to be kept all the same."""
    found = {name: rule(facts) for name, rule in RULES.items() if name not in keep}
    return tuple(SkippedWork(what=name, why=reason[0], same=reason[1]) for name, reason in found.items() if reason)
