"""Requirements of a scene on a path tracer: everything that its picture depends on and nothing else.

It is decided here alone: the renderer takes its settings from it, and `plan --explain` says what is skipped and why.
"""

from dataclasses import dataclass

from spin_usd.renderers.background.surroundings import Surroundings
from spin_usd.renderers.skipped.facts import Facts
from spin_usd.renderers.skipped.material_needs import Surfaces
from spin_usd.renderers.skipped.rules import SkippedWork, late_bounces, skipped_work
from spin_usd.scene.effort import Effort
from spin_usd.scene.material import Material
from spin_usd.scene.model import Scene

READ_MORE = frozenset(("primvars", "material inputs", "unseen materials"))


@dataclass(frozen=True, kw_only=True, eq=False)
class Requirements:
    """The work that a picture requires, and the work that is `skipped`, with the reasons.

    scene: as it is to be rendered, without blur that does not show; its region stays · materials: of each body, as far
    as they matter · primvars: those that each body's mesh must have · shading: whether there is any light; else only
    coverage · lights: indices of those with a place or a direction that shine on some body · shadows: whether rays look
    for what is in their way · emissive_lights: whether emissive faces are looked for as lights · surroundings: what
    shines from all around; world: whether there is to be a sky, world_sampling: whether rays look for where it is
    bright · bounces: of any kind, glossy, through refraction (transmission) and in volumes · transparent: whether rays
    may go on through a surface or a lamp · light_tree: whether lights are chosen by what they do · filter_glossy: that
    of the effort, or 0 · camera_shader: even where a plain camera would do · light_groups: passes even for a single
    one.
    """

    skipped: tuple[SkippedWork, ...]
    scene: Scene
    materials: tuple[tuple[Material, ...], ...]
    primvars: tuple[frozenset[str], ...]
    shading: bool
    lights: tuple[int, ...]
    shadows: bool
    emissive_lights: bool
    surroundings: Surroundings | None
    world: bool
    world_sampling: bool
    bounces: int
    glossy_bounces: int
    transmission_bounces: int
    volume_bounces: int
    transparent: bool
    light_tree: bool
    filter_glossy: float
    camera_shader: bool
    light_groups: bool

    @classmethod
    def of(cls, scene: Scene, effort: Effort, keep: frozenset[str] = frozenset()) -> "Requirements":
        """Return the requirements of a picture of `scene`. `keep`: names of what is to be done even where it changes
        nothing, to measure it; it changes no byte that SkippedWork.same does not allow to change."""
        facts = Facts(scene=scene, effort=effort)
        reasons = skipped_work(facts, keep)
        without = {each.what for each in reasons}
        least = late_bounces(facts) if "late bounces" in without else effort.bounces
        bounces = 0 if "bounces" in without else least
        return cls(
            skipped=reasons,
            scene=_without_invisible_blur(scene, without),
            materials=tuple(_materials(surfaces, keep) for surfaces in facts.surfaces.each),
            primvars=tuple(_primvars(surfaces, keep) for surfaces in facts.surfaces.each),
            shading="shading" not in without,
            lights=facts.lights,
            shadows="shadow rays" not in without,
            emissive_lights="emissive faces as lights" not in without,
            surroundings=facts.surroundings,
            world="world" not in without,
            world_sampling="world sampling" not in without,
            bounces=bounces,
            glossy_bounces=0 if "glossy bounces" in without else bounces,
            transmission_bounces=0 if "transmission bounces" in without else bounces,
            volume_bounces=0 if "volumes" in without else bounces,
            transparent="transparent layers" not in without,
            light_tree=effort.light_tree and "light tree" not in without,
            filter_glossy=0.0 if "glossy filter" in without else effort.filter_glossy,
            camera_shader="camera shader" not in without,
            light_groups="light groups" not in without,
        )


def _without_invisible_blur(scene: Scene, without: set[str]) -> Scene:
    """`scene` without blur that does not show; its region, in which pictures are exchanged, stays."""
    lens = None if "depth of field" in without else scene.thin_lens
    shutter = None if "motion blur" in without else scene.shutter
    return scene.with_blur(thin_lens=lens, shutter=shutter)


def _primvars(surfaces: Surfaces, keep: frozenset[str]) -> frozenset[str]:
    return surfaces.target.mesh.primvar_names if keep & READ_MORE else surfaces.primvars


def _materials(surfaces: Surfaces, keep: frozenset[str]) -> tuple[Material, ...]:
    own = ("unseen materials" if i in surfaces.unseen else "material inputs" for i in range(len(surfaces.materials)))
    pairs = zip(own, surfaces.target.materials, surfaces.materials, strict=True)
    return tuple(authored if name in keep else needed for name, authored, needed in pairs)
