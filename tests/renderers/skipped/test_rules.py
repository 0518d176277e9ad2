"""What is left out of a render: switched off indeed, and the picture is the same as with it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.renderers.blender.textures import forget_render_data
from spin_usd.renderers.skipped.requirements import Requirements
from spin_usd.renderers.skipped.rules import BITS, ROUNDING, RULES
from spin_usd.scene.effort import Effort
from spin_usd.scene.model import Scene, ThinLens
from tests.cases import scenes
from tests.cases.lit_scenes import BALL, DARK, DOME, GLOWING, MATT, METAL, PINHOLE, SUN, a_scene, textured
from tests.cases.scenes import in_motion, with_first

SAMPLES = 16
ROUNDED = 2 * SAMPLES * 2.0**-24 + 1e-6  # relative: of float32, at each sample that is added and in each look-up
APERTURE = "\trim\t"  # a variable of the camera shader: where on the lens a ray starts
UNSEEN = 0.1  # of the noise, RMS: rays that go a thousandth of a pixel aside
SAME_ON_AVERAGE = 0.02  # relative: noise of some thousand pixels of 4 x SAMPLES samples that choose among two lights
POSE = scenes.pose(q=(1, 0.2, 0.1, 0.05))  # onto the floor of a corner


@dataclass(frozen=True, kw_only=True)
class Case:
    """A scene that does not need something; `off`: whether Blender now goes without; its scene."""

    scene: Scene
    off: Callable[[], object]
    effort: Effort = Effort(samples=SAMPLES)  # noqa: RUF009 - frozen


def posed(*materials, **options):
    return with_first(a_scene(*materials, **options), T_cam_body=POSE)


def moving(scene, metres):
    poses = tuple(replace(POSE, translation=POSE.translation + np.array([metres * s, 0, 0])) for s in (-1, 0, 1))
    return in_motion(scene, poses)


def cycles():
    return bpy.context.scene.cycles


def surfaces():
    """The materials of the targets that are rendered; bodies of the scene before are still there, hidden."""
    targets = [each for each in bpy.data.objects if each.name.startswith("target") and not each.hide_render]
    return [slot for shown in targets for slot in shown.data.materials]


def node_kinds():
    return {node.bl_idname for material in surfaces() for node in material.node_tree.nodes}


def attributes():
    return [each.name for each in bpy.data.objects["target"].data.attributes if each.name.startswith("primvar")]


ST = np.random.default_rng(0).random((12, 3, 2)).astype(np.float32)
ROUGH = textured(0.1, 0.9)
FILTERED = Effort(samples=SAMPLES, filter_glossy=0.3)
BOX = {"points_faces": scenes.box()}
IDLE = replace(
    MATT, roughness=ROUGH, specular_color=textured((0.1,) * 3, (0.2,) * 3), diffuse_color=textured((0.3,) * 3)
)
MIRROR = replace(METAL, metallic=1.0, roughness=0.2)
CASES = {
    "shading": Case(scene=posed(METAL, lights=()), off=lambda: bpy.context.scene.view_layers[0].material_override),
    "bounces": Case(scene=posed(MIRROR, **BOX), off=lambda: cycles().max_bounces == cycles().diffuse_bounces == 0),
    "late bounces": Case(
        scene=posed(replace(DARK, diffuse_color=(0.09,) * 3)),
        off=lambda: cycles().max_bounces == 3,
        effort=Effort(samples=SAMPLES, bounces=8),
    ),
    "glossy bounces": Case(
        scene=posed(MATT), off=lambda: (cycles().glossy_bounces, cycles().diffuse_bounces) == (0, 4)
    ),
    "glossy filter": Case(scene=posed(MATT), off=lambda: cycles().blur_glossy == 0, effort=FILTERED),
    "glossy filter under a large lamp": Case(
        scene=posed(METAL, lights=(replace(BALL, radius=1.0),)), off=lambda: cycles().blur_glossy == 0, effort=FILTERED
    ),
    "transmission bounces": Case(scene=posed(METAL), off=lambda: cycles().transmission_bounces == 0),
    "volumes": Case(scene=posed(METAL), off=lambda: cycles().volume_bounces == 0),
    "transparent layers": Case(scene=posed(METAL), off=lambda: cycles().transparent_max_bounces == 0),
    "light tree": Case(scene=posed(METAL), off=lambda: not cycles().use_light_tree),
    "light tree beside a sky": Case(scene=posed(METAL, lights=(SUN, DOME)), off=lambda: not cycles().use_light_tree),
    "shadow rays": Case(
        scene=posed(MIRROR, **BOX, lights=(SUN, BALL)), off=lambda: not any(lamp.use_shadow for lamp in bpy.data.lights)
    ),
    "emissive faces as lights": Case(
        scene=posed(replace(GLOWING, emissive_color=(90.0,) * 3), **BOX),
        off=lambda: {material.cycles.emission_sampling for material in surfaces()} == {"NONE"},
    ),
    "world": Case(scene=posed(METAL), off=lambda: bpy.context.scene.world is None),
    "world sampling": Case(
        scene=posed(METAL, lights=(DOME,)), off=lambda: bpy.context.scene.world.cycles.sampling_method == "NONE"
    ),
    "depth of field": Case(
        scene=replace(posed(METAL), thin_lens=ThinLens(radius=1e-5, focus=4.0)),
        off=lambda: APERTURE not in bpy.context.scene.camera.data.custom_bytecode,
    ),
    "motion blur": Case(scene=moving(posed(METAL), 1e-6), off=lambda: not bpy.context.scene.render.use_motion_blur),
    "camera shader": Case(
        scene=posed(METAL, camera=PINHOLE), off=lambda: bpy.context.scene.camera.data.type == "PERSP"
    ),
    "light groups": Case(scene=posed(METAL), off=lambda: not bpy.context.scene.view_layers[0].lightgroups),
    "material inputs": Case(
        scene=posed(IDLE, **BOX, primvars={"st": ST}), off=lambda: "ShaderNodeTexImage" not in node_kinds()
    ),
    "unseen materials": Case(
        scene=(lambda s: with_first(s, target=replace(s.target, materials=(MATT, IDLE))))(
            posed(MATT, **BOX, primvars={"st": ST})
        ),
        off=lambda: "ShaderNodeTexImage" not in node_kinds(),
    ),
    "primvars": Case(scene=posed(METAL, **BOX, primvars={"st": ST}), off=lambda: not attributes()),
}


def name_of(case):
    return case.partition(" beside ")[0].partition(" under ")[0]


def same_of(case):
    required = Requirements.of(CASES[case].scene, CASES[case].effort)
    return {each.what: each.same for each in required.skipped}[name_of(case)]


@pytest.fixture
def keeping(blender, monkeypatch):
    """Render while keeping what these names say."""

    def render(scene, effort, *names, seed=1):
        monkeypatch.setattr(blender, "_keep", frozenset(names))
        return blender.radiance(scene, effort, seed=seed)

    return render


def test_there_is_a_case_of_each() -> None:
    assert {name_of(case) for case in CASES} == set(RULES)


def left(case, keep=()):
    required = Requirements.of(CASES[case].scene, CASES[case].effort, frozenset(keep))
    return {each.what for each in required.skipped}


@pytest.mark.parametrize("case", CASES)
def test_what_is_to_be_kept_is_kept_and_nothing_else(case) -> None:
    what = name_of(case)
    assert what in left(case)
    assert left(case, keep=[what]) == left(case) - {what}
    assert not left(case, keep=RULES)


@pytest.mark.parametrize("case", CASES)
def test_it_is_switched_off_and_on_again(keeping, case) -> None:
    keeping(CASES[case].scene, CASES[case].effort)
    assert CASES[case].off()
    keeping(CASES[case].scene, CASES[case].effort, name_of(case))
    assert not CASES[case].off()


@pytest.mark.parametrize("case", [case for case in CASES if same_of(case) in (BITS, ROUNDING)])
def test_the_picture_is_the_same_with_it(keeping, case) -> None:
    scene, effort = CASES[case].scene, CASES[case].effort
    without, kept = keeping(scene, effort), keeping(scene, effort, name_of(case))
    assert without.coverage.any()
    np.testing.assert_array_equal(kept.coverage, without.coverage)
    if same_of(case) == BITS:
        np.testing.assert_array_equal(kept.groups, without.groups)
    else:
        assert same_of(case) == ROUNDING
        np.testing.assert_allclose(kept.groups, without.groups, rtol=ROUNDED)


@pytest.mark.parametrize("case", ["light tree beside a sky", "emissive faces as lights"])
def test_the_picture_is_the_same_but_for_its_noise_which_does_not_grow(keeping, case) -> None:
    scene, effort = CASES[case].scene, replace(CASES[case].effort, samples=4 * SAMPLES)
    pictures = {
        names: [keeping(scene, effort, *names, seed=seed).rgb for seed in range(4)] for names in ((), (name_of(case),))
    }
    without, kept = pictures.values()
    assert np.mean(without) == pytest.approx(np.mean(kept), rel=SAME_ON_AVERAGE)
    assert np.std(without, 0).mean() <= 1.1 * np.std(kept, 0).mean()


@pytest.mark.parametrize("case", ["depth of field", "motion blur", "camera shader"])
def test_rays_that_go_elsewhere_go_there_by_less_than_shows(keeping, case) -> None:
    scene, effort = CASES[case].scene, CASES[case].effort
    without, kept, other = keeping(scene, effort), keeping(scene, effort, name_of(case)), keeping(scene, effort, seed=9)
    assert rms(kept.rgb - without.rgb) <= UNSEEN * rms(other.rgb - without.rgb)


@pytest.mark.parametrize("share", [0.3, 0.03])
def test_late_bounces_hold_as_little_as_is_said(keeping, monkeypatch, share) -> None:
    """Were so much of the light little enough: of less there is no trace in so few samples."""
    monkeypatch.setattr("spin_usd.renderers.skipped.rules.DARK_ENOUGH", share)
    scene, effort = posed(replace(DARK, diffuse_color=(0.15,) * 3)), Effort(samples=64, bounces=8)
    without, kept = keeping(scene, effort), keeping(scene, effort, "late bounces")
    assert 0 < kept.rgb.sum(dtype=float) - without.rgb.sum(dtype=float) <= share * kept.rgb.sum(dtype=float)


def test_what_matters_changes_the_picture_when_it_is_left_out(keeping, monkeypatch) -> None:
    """Each rule, were it to hold where it does not, would be found by the tests above."""
    concave, clear = posed(replace(MATT, diffuse_color=(0.9,) * 3)), posed(replace(METAL, opacity=0.5), **BOX)
    shaded = replace(concave, lights=(replace(SUN, direction_cam=(0.0, 0.8, -0.6)),))
    wrong = [("bounces", concave), ("shadow rays", shaded), ("glossy bounces", posed(MIRROR)), ("shading", concave)]
    wrong += [("transparent layers", clear), ("world", posed(METAL, lights=(DOME,)))]
    for name, scene in wrong:
        right = keeping(scene, Effort(samples=SAMPLES))
        with monkeypatch.context() as patch:
            patch.setattr(
                "spin_usd.renderers.skipped.rules.RULES", {**RULES, name: lambda facts: ("it is not so", BITS)}
            )
            assert not np.array_equal(keeping(scene, Effort(samples=SAMPLES)).rgba, right.rgba), name


def test_pictures_that_need_different_things_do_not_disturb_one_another(blender, keeping) -> None:
    """Whatever was rendered before, kept or left out, and in a renderer just opened."""
    first = [keeping(case.scene, case.effort).rgba.tobytes() for case in CASES.values()]
    cases = list(CASES.values())
    for turn, index in enumerate(np.random.default_rng(5).integers(0, len(cases), 3 * len(cases) // 2)):
        if turn % 5 == 0:
            forget_render_data()
        if turn % 4 == 1:
            keeping(cases[index].scene, Effort(samples=2), *RULES)
        if turn % 4 == 2:
            blender.visibility(cases[index].scene)
        assert keeping(cases[index].scene, cases[index].effort).rgba.tobytes() == first[index]


def test_denoised_pictures_are_the_same_too(keeping) -> None:
    """Whose guides are of the materials that are needed."""
    scene, effort = CASES["material inputs"].scene, Effort(samples=4, denoiser="fast")
    without, kept = keeping(scene, effort), keeping(scene, effort, "material inputs")
    np.testing.assert_allclose(kept.rgb, without.rgb, rtol=1e-4, atol=1e-4 * without.rgb.max())


def test_names_that_mean_nothing_are_refused() -> None:
    from spin_usd.renderers.skipped.rules import check_rule_names

    with pytest.raises(InputError, match="light trees"):
        check_rule_names(["light trees"])


def rms(values):
    return np.sqrt(np.square(values, dtype=float).mean())
