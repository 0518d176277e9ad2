"""What a scene needs of a path tracer: nothing is left out where it matters, and what does not matter is."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.renderers.skipped.material_needs import surfaces_of
from spin_usd.renderers.skipped.requirements import Requirements
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.material import Material
from spin_usd.scene.model import ThinLens
from spin_usd.scene.texture import Primvar, Texture
from tests.cases import scenes
from tests.cases.lit_scenes import (
    BALL,
    DARK,
    DOME,
    EARTH,
    GLOWING,
    MATT,
    METAL,
    PINHOLE,
    SUN,
    TUBE,
    a_scene,
    image,
    textured,
)
from tests.cases.scenes import in_motion, with_first

ALWAYS = {"transmission bounces", "volumes"}
DEEP_SPACE = {*ALWAYS, "glossy bounces", "transparent layers", "light tree", "world", "light groups"}


def left(scene, effort=Effort(), keep=()):  # noqa: B008 - frozen
    return {each.what for each in Requirements.of(scene, effort, frozenset(keep)).skipped}


def test_a_matt_target_under_a_sun_in_deep_space_pays_for_none_of_what_others_need() -> None:
    scene = a_scene(MATT)
    assert left(scene) == {*DEEP_SPACE, "material inputs"}
    required = Requirements.of(scene, Effort(bounces=3))
    assert (required.bounces, required.glossy_bounces, required.transmission_bounces) == (3, 0, 0)
    assert (required.volume_bounces, required.transparent, required.light_tree, required.world) == (
        0,
        False,
        False,
        False,
    )
    assert (required.shadows, required.shading, required.lights) == (True, True, (0,))


@pytest.mark.parametrize(
    ("material", "matt"),
    [
        (MATT, True),
        (replace(MATT, use_specular_workflow=True, ior=1.5), True),
        (replace(MATT, use_specular_workflow=True, specular_color=(0.0, 0.0, 0.1)), False),
        (replace(MATT, ior=1.01), False),
        (replace(MATT, metallic=0.1), False),
        (replace(MATT, clearcoat=0.1), False),
        (replace(MATT, opacity=0.5), False),  # what is clear still reflects
        (replace(MATT, opacity=0.5, opacity_mode="presence"), True),
        (replace(MATT, clearcoat=textured(0.0, 0.0)), True),
        (replace(MATT, metallic=textured(0.0, 0.1)), False),
    ],
)
def test_only_matt_materials_go_without_glossy_bounces(material, matt) -> None:
    assert ("glossy bounces" in left(a_scene(MATT, material))) == matt


@pytest.mark.parametrize(
    ("material", "light", "bounces", "filtered"),
    [
        (METAL, SUN, 4, True),
        (METAL, replace(SUN, angle=0.2), 4, False),
        (METAL, replace(BALL, radius=0.1), 4, True),
        (METAL, replace(BALL, radius=1.0), 4, False),
        (METAL, DOME, 4, False),
        (METAL, SUN, 0, False),
        (MATT, SUN, 4, False),
    ],
)
def test_glossy_surfaces_are_filtered_where_a_small_light_makes_them_glint(material, light, bounces, filtered) -> None:
    effort = Effort(filter_glossy=0.3, bounces=bounces)
    assert Requirements.of(a_scene(material, lights=(light,)), effort).filter_glossy == 0.3 * filtered


@pytest.mark.parametrize(
    ("material", "clear"),
    [
        (MATT, False),
        (replace(MATT, opacity=0.99), True),
        (replace(MATT, opacity=textured(1.0, 1.0)), False),
        (replace(MATT, opacity=textured(1.0, 0.9)), True),
        (replace(MATT, opacity=textured(0.8, 0.9), opacity_threshold=0.5), False),
        (replace(MATT, opacity=textured(0.4, 0.9), opacity_threshold=0.5), True),
    ],
)
def test_rays_may_go_on_through_what_is_clear_or_cut_out_or_a_lamp(material, clear) -> None:
    assert ("transparent layers" not in left(a_scene(MATT, material))) == clear
    assert "transparent layers" not in left(a_scene(material, lights=(SUN, BALL)))


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
        ((SUN,), (MATT,), (EARTH,), False),
    ],
)
def test_lights_are_chosen_among_where_there_are_several(lights, materials, planets, tree) -> None:
    scene = a_scene(*materials, lights=lights, planets=planets)
    assert ("light tree" not in left(scene)) == tree
    assert "light tree" not in left(scene, Effort(light_tree=False))  # the user's choice, not ours
    assert not Requirements.of(scene, Effort(light_tree=False)).light_tree


def test_the_sky_is_there_where_it_shines_and_searched_where_it_varies() -> None:
    assert "world" in left(a_scene(MATT))
    assert {"world", "world sampling"} & left(a_scene(MATT, lights=(SUN, DOME))) == {"world sampling"}
    starry = replace(DOME, image=image(0.0, 1.0))
    assert not {"world", "world sampling"} & left(a_scene(MATT, lights=(SUN, starry)))
    assert not {"world", "world sampling"} & left(a_scene(MATT, planets=(EARTH,)))
    assert "world" in left(a_scene(MATT, planets=(replace(EARTH, illuminates=False),)))


def test_convex_targets_seen_from_outside_have_no_bounces_nor_shadows() -> None:
    box, tilted = scenes.box(), {"bounces", "shadow rays"}
    assert left(a_scene(MATT, points_faces=box)) >= tilted
    assert left(a_scene(METAL, points_faces=box)) >= tilted
    assert not left(a_scene(MATT)) & tilted  # its walls see one another
    assert not left(a_scene(MATT, points_faces=(box[0], box[1][2:]))) & tilted  # open: its inside is seen
    assert not left(a_scene(replace(MATT, opacity=0.5), points_faces=box)) & tilted
    within = with_first(a_scene(MATT, points_faces=box), T_cam_body=scenes.pose(t=(0, 0, 0)))
    assert not left(within) & tilted
    bumpy = replace(MATT, normal=textured((0.0, 0.1, 0.9)))
    assert left(a_scene(bumpy, points_faces=box)) & tilted == {"bounces"}
    assert Requirements.of(a_scene(MATT, points_faces=box), Effort(bounces=4)).bounces == 0


def test_smooth_convex_targets_keep_their_shadows() -> None:
    """Their shading turns to the light where their faces do not."""
    scene = a_scene(MATT, points_faces=scenes.box())
    normals = np.repeat(scene.target.mesh.points[scene.target.mesh.faces] * 2 / np.sqrt(3), 1, 0)
    smooth = replace(scene.target, mesh=replace(scene.target.mesh, corner_normals=normals))
    assert left(with_first(scene, target=smooth)) & {"bounces", "shadow rays"} == {"bounces"}


def test_what_glows_is_looked_for_unless_it_lights_nothing() -> None:
    assert "emissive faces as lights" not in left(a_scene(GLOWING))
    assert left(a_scene(GLOWING, points_faces=scenes.box())) >= {"emissive faces as lights", "light tree"}
    black = replace(MATT, emissive_color=textured((0.0, 0, 0), (0, 0, 0.0)))
    assert "light tree" in left(a_scene(black))


@pytest.mark.parametrize("asked", [0, 1, 2, 4, 8])
def test_late_bounces_hold_too_little_light_only_where_all_is_dark_and_matt(asked) -> None:
    effort = Effort(bounces=asked)
    kept = Requirements.of(a_scene(DARK), effort).bounces
    missing = sum(0.05**n for n in range(kept + 1, 200))
    assert kept <= asked
    assert missing <= 1e-4 or kept == asked
    for bright in (MATT, replace(DARK, diffuse_color=textured((0.1,) * 3, (1.0,) * 3)), replace(DARK, metallic=0.5)):
        assert Requirements.of(a_scene(DARK, bright), effort).bounces == asked


def test_light_is_traced_where_there_is_any() -> None:
    for lights in ((), (replace(SUN, obscuration=1.0),), (replace(SUN, lights=frozenset()),)):
        assert "shading" in left(a_scene(MATT, lights=lights))
        assert "shading" not in left(a_scene(replace(MATT, opacity=0.5), lights=lights))  # coverage depends on it
        assert "shading" not in left(a_scene(GLOWING, lights=lights))
    for light in (SUN, BALL, DOME):
        assert "shading" not in left(a_scene(MATT, lights=(light,)))


def test_inputs_that_change_nothing_are_not_looked_up() -> None:
    rough, flat = textured(0.1, 0.9), textured((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    some = [
        replace(MATT, roughness=rough, clearcoat_roughness=rough, specular_color=textured((0.1,) * 3, (0.2,) * 3)),
        replace(METAL, metallic=1.0, ior=textured(1.2, 1.4), normal=flat),
        replace(MATT, use_specular_workflow=True, metallic=rough, ior=rough, diffuse_color=textured((0.2,) * 3)),
    ]
    found = surfaces_of(a_scene(*some).target)
    assert not any(isinstance(value, (Texture, Primvar)) for m in found.materials for value in vars(m).values())
    assert found.materials[0] == replace(MATT, roughness=0.5)
    assert set(found.idle) == {"roughness", "clearcoatRoughness", "specularColor", "metallic", "ior", "normal", "diffuseColor"}  # fmt: skip  # noqa: E501
    needed = [
        replace(METAL, roughness=rough, ior=textured(1.2, 1.4), normal=textured((0.0, 0.1, 0.9), (0.0, 0.0, 1.0))),
        replace(METAL, clearcoat=0.1, clearcoat_roughness=rough),
        replace(METAL, use_specular_workflow=True, specular_color=textured((0.1,) * 3, (0.2,) * 3), metallic=0.0),
    ]
    assert surfaces_of(a_scene(*needed).target).materials == tuple(
        replace(m, **({} if i == 1 else {"clearcoat_roughness": 0.01}), **({"ior": 1.5} if i == 2 else {}))
        for i, m in enumerate(needed)
    )


def test_primvars_and_materials_that_no_face_shows_are_not_needed() -> None:
    values = np.random.default_rng(0).random((4, 3, 3)).astype(np.float32)
    primvars = {"colour": values, "idle": values, "st": values[..., :2]}
    seen = replace(MATT, diffuse_color=Primvar(name="colour"))
    scene = a_scene(seen, primvars=primvars)
    unseen = replace(scene.target, materials=(seen, replace(METAL, roughness=textured(0.1, 0.9), opacity=0.5)))
    required = Requirements.of(with_first(scene, target=unseen), Effort())
    assert {"unseen materials", "primvars", "transparent layers"} <= {each.what for each in required.skipped}
    assert required.primvars == (frozenset({"colour"}),)
    assert required.materials[0][1] == Material(path="")
    tilted = replace(seen, normal=Primvar(name="colour"))
    assert Requirements.of(a_scene(tilted, primvars=primvars), Effort()).primvars == (frozenset({"colour", "st"}),)


@pytest.mark.parametrize(("metres", "shown"), [(0.0, False), (1e-8, False), (1e-3, True), (1.0, True)])
def test_blur_that_does_not_show_is_left_out(metres, shown) -> None:
    still = a_scene(MATT, camera=PINHOLE, points_faces=scenes.box())
    there = still.T_cam_body
    poses = tuple(replace(there, translation=there.translation + np.array([metres * s, 0, 0])) for s in (-1, 0, 1))
    moving = in_motion(still, poses)
    assert ("motion blur" not in left(moving)) == shown
    required = Requirements.of(moving, Effort())
    assert (required.scene.shutter is not None) == shown
    assert required.scene.picture_region == moving.picture_region
    if metres:
        blurred = replace(still, thin_lens=ThinLens(radius=metres, focus=4.2))
        assert ("depth of field" not in left(blurred)) == shown
        assert (Requirements.of(blurred, Effort()).scene.thin_lens is not None) == shown
        assert ("camera shader" not in left(blurred)) == shown


def test_what_turns_in_place_moves() -> None:
    still = a_scene(MATT, points_faces=scenes.box())
    turned = (scenes.pose(q=(1, s * 1e-3, 0, 0)) for s in (-1, 0, 1))
    assert "motion blur" not in left(in_motion(still, turned))


def test_a_scene_in_unit_light_needs_what_it_needs_in_its_own() -> None:
    for lights in ((SUN, BALL, DOME), (), (replace(SUN, obscuration=1.0), TUBE), (replace(SUN, obscuration=1.0),)):
        scene = a_scene(METAL, lights=lights, planets=(EARTH,))
        assert Requirements.of(scene, Effort()).skipped == Requirements.of(in_unit_light(scene).scene, Effort()).skipped


def test_what_is_wrong_in_materials_is_left_to_be_refused() -> None:
    wrong = replace(MATT, roughness=Primvar(name="nowhere"), opacity=Primvar(name="nowhere"), opacity_threshold=0.5)
    assert Requirements.of(a_scene(replace(wrong, diffuse_color=Primvar(name="nowhere"))), Effort()).transparent
