"""What a picture does not need: it is skipped where that changes nothing, and only there, and switched off indeed."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy
import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.renderers.blender.textures import forget_render_data
from spin_usd.renderers.skipped import BITS, RULES, Requirements, check_rule_names
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.scene import Scene, ThinLens
from tests.cases import scenes
from tests.cases.lit_scenes import BALL, DOME, EARTH, GLOWING, MATT, METAL, PINHOLE, SUN, TUBE, a_scene, image, textured
from tests.cases.scenes import in_motion, with_first

SAMPLES = 16
UNSEEN = 0.1  # of the noise, RMS: rays that go a thousandth of a pixel aside
SAME_ON_AVERAGE = 0.02  # relative: noise of some thousand pixels of 4 x SAMPLES samples that choose among two lights
POSE = scenes.pose(q=(1, 0.2, 0.1, 0.05))  # onto the floor of a corner
BOX = {"points_faces": scenes.box()}


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


CASES = {
    "glossy filter": Case(
        scene=posed(METAL, lights=(replace(BALL, radius=1.0),)),
        off=lambda: cycles().blur_glossy == 0,
        effort=Effort(samples=SAMPLES, filter_glossy=0.3),
    ),
    "light tree": Case(scene=posed(METAL), off=lambda: not cycles().use_light_tree),
    "light tree beside a sky": Case(scene=posed(METAL, lights=(SUN, DOME)), off=lambda: not cycles().use_light_tree),
    "camera shader": Case(
        scene=posed(METAL, camera=PINHOLE), off=lambda: bpy.context.scene.camera.data.type == "PERSP"
    ),
}
OTHERS = (
    posed(METAL, lights=()),
    posed(METAL, lights=(SUN, BALL, TUBE)),
    posed(METAL, lights=(replace(DOME, image=image(0.0, 1.0)),)),
    posed(GLOWING, **BOX),
    posed(replace(METAL, opacity=0.5, roughness=textured(0.1, 0.9)), **BOX, primvars={"st": np.zeros((12, 3, 2), "f")}),
    replace(posed(METAL), thin_lens=ThinLens(radius=1e-2, focus=4.0)),
    moving(posed(MATT), 1e-2),
)
"""Scenes that need other things."""


def name_of(case):
    return case.partition(" beside ")[0]


def left(scene, effort=Effort(), keep=()):  # noqa: B008 - frozen
    return {each.what for each in Requirements.of(scene, effort, frozenset(keep)).skipped}


@pytest.fixture
def keeping(blender, monkeypatch):
    """Render while keeping what these names say."""

    def render(scene, effort, *names, seed=1):
        monkeypatch.setattr(blender, "_keep", frozenset(names))
        return blender.radiance(scene, effort, seed=seed)

    return render


@pytest.mark.parametrize(
    ("material", "light", "filtered"),
    [
        (METAL, SUN, True),
        (METAL, replace(SUN, angle=0.2), False),
        (METAL, replace(BALL, radius=0.1), True),
        (METAL, replace(BALL, radius=1.0), False),
        (METAL, DOME, False),
    ],
)
def test_glossy_surfaces_are_filtered_where_a_small_light_makes_them_glint(material, light, filtered) -> None:
    required = Requirements.of(a_scene(material, lights=(light,)), Effort(filter_glossy=0.3))
    assert required.filter_glossy == 0.3 * filtered


@pytest.mark.parametrize(
    ("lights", "materials", "planets", "tree"),
    [
        ((SUN,), (MATT,), (), False),
        ((SUN, DOME), (MATT,), (), False),
        ((BALL,), (MATT,), (), False),
        ((SUN, replace(SUN, irradiance=(0.0,) * 3)), (MATT,), (), False),
        ((SUN, replace(SUN, lights=frozenset())), (MATT,), (), False),
        ((SUN, replace(SUN, lights=frozenset([7]))), (MATT,), (), False),
        ((SUN, SUN), (MATT,), (), True),
        ((TUBE,), (MATT,), (), True),
        ((SUN,), (GLOWING,), (), True),
        ((SUN,), (replace(MATT, emissive_color=textured((0.0, 0, 0), (0, 0, 0.0))),), (), False),
        ((SUN,), (MATT,), (EARTH,), False),
    ],
)
def test_lights_are_chosen_among_where_there_are_several(lights, materials, planets, tree) -> None:
    scene = a_scene(*materials, lights=lights, planets=planets)
    assert ("light tree" not in left(scene)) == tree
    assert "light tree" not in left(scene, Effort(light_tree=False))  # the user's choice, not ours
    assert not Requirements.of(scene, Effort(light_tree=False)).light_tree


def test_only_a_pinhole_goes_without_the_camera_shader() -> None:
    plain = a_scene(MATT, camera=PINHOLE)
    assert "camera shader" in left(plain)
    assert "camera shader" not in left(a_scene(MATT))
    assert "camera shader" not in left(replace(plain, thin_lens=ThinLens(radius=1e-3, focus=4.2)))


def test_there_is_a_world_where_something_shines_from_afar(blender) -> None:
    dark = a_scene(MATT), a_scene(MATT, planets=(replace(EARTH, illuminates=False),))
    lit = a_scene(MATT, lights=(SUN, DOME)), a_scene(MATT, planets=(EARTH,))
    for scene in (*lit, *dark, *lit):
        blender.radiance(scene, Effort(samples=1), seed=0)
        assert (bpy.context.scene.world is not None) == (scene in lit)


def test_a_scene_in_unit_light_needs_what_it_needs_in_its_own() -> None:
    for lights in ((SUN, BALL, DOME), (), (replace(SUN, obscuration=1.0), TUBE), (replace(SUN, obscuration=1.0),)):
        scene = a_scene(METAL, lights=lights, planets=(EARTH,))
        assert Requirements.of(scene, Effort()).skipped == Requirements.of(in_unit_light(scene).scene, Effort()).skipped


def test_there_is_a_case_of_each() -> None:
    assert {name_of(case) for case in CASES} == set(RULES)


@pytest.mark.parametrize("case", CASES)
def test_what_is_to_be_kept_is_kept_and_nothing_else(case) -> None:
    what, of = name_of(case), (CASES[case].scene, CASES[case].effort)
    assert what in left(*of)
    assert left(*of, keep=[what]) == left(*of) - {what}
    assert not left(*of, keep=RULES)


@pytest.mark.parametrize("case", CASES)
def test_it_is_switched_off_and_on_again(keeping, case) -> None:
    keeping(CASES[case].scene, CASES[case].effort)
    assert CASES[case].off()
    keeping(CASES[case].scene, CASES[case].effort, name_of(case))
    assert not CASES[case].off()


def test_the_picture_of_one_light_is_the_same_with_a_tree(keeping) -> None:
    scene, effort = CASES["light tree"].scene, CASES["light tree"].effort
    assert {each.same for each in Requirements.of(scene, effort).skipped if each.what == "light tree"} == {BITS}
    without, kept = keeping(scene, effort), keeping(scene, effort, "light tree")
    assert without.coverage.any()
    np.testing.assert_array_equal(kept.coverage, without.coverage)
    np.testing.assert_array_equal(kept.groups, without.groups)


def test_the_picture_beside_a_sky_is_the_same_but_for_its_noise_which_does_not_grow(keeping) -> None:
    scene, effort = CASES["light tree beside a sky"].scene, Effort(samples=4 * SAMPLES)
    pictures = {
        names: [keeping(scene, effort, *names, seed=seed).rgb for seed in range(4)] for names in ((), ("light tree",))
    }
    without, kept = pictures.values()
    assert np.mean(without) == pytest.approx(np.mean(kept), rel=SAME_ON_AVERAGE)
    assert np.std(without, 0).mean() <= 1.1 * np.std(kept, 0).mean()


def test_rays_of_a_plain_camera_go_elsewhere_by_less_than_shows(keeping) -> None:
    scene, effort = CASES["camera shader"].scene, CASES["camera shader"].effort
    without, kept = keeping(scene, effort), keeping(scene, effort, "camera shader")
    other = keeping(scene, effort, seed=9)
    assert rms(kept.rgb - without.rgb) <= UNSEEN * rms(other.rgb - without.rgb)


def test_pictures_that_need_different_things_do_not_disturb_one_another(blender, keeping) -> None:
    """Whatever was rendered before, kept or left out, and in a renderer just opened."""
    cases = [*((case.scene, case.effort) for case in CASES.values()), *((each, Effort(samples=4)) for each in OTHERS)]
    first = [keeping(*case).rgba.tobytes() for case in cases]
    for turn, index in enumerate(np.random.default_rng(5).integers(0, len(cases), 3 * len(cases))):
        if turn % 5 == 0:
            forget_render_data()
        if turn % 4 == 1:
            keeping(cases[index][0], Effort(samples=2), *RULES)
        if turn % 4 == 2:
            blender.visibility(cases[index][0])
        assert keeping(*cases[index]).rgba.tobytes() == first[index]


@pytest.mark.parametrize("denoiser", ["none", "fast"])
def test_what_no_light_reaches_is_black_and_there(blender, denoiser) -> None:
    effort = Effort(samples=4, denoiser=denoiser)
    for lights in ((), (replace(SUN, obscuration=1.0),), (replace(SUN, lights=frozenset()),)):
        found = blender.radiance(posed(METAL, lights=lights), effort, seed=0)
        assert found.coverage.any()
        assert not found.rgb.any()


def test_names_that_mean_nothing_are_refused() -> None:
    with pytest.raises(InputError, match="light trees"):
        check_rule_names(["light trees"])


def rms(values):
    return np.sqrt(np.square(values, dtype=float).mean())
