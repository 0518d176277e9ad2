"""What faces show of materials: a texture that is the same everywhere is its number, and what no face shows is not."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.scene.derived.shown_materials import shown_materials
from spin_usd.scene.texture import Primvar
from tests.cases.lit_scenes import GLOWING, MATT, METAL, a_scene, textured


@pytest.mark.parametrize(
    ("material", "diffuse"),
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
def test_what_reflects_by_lamberts_law_alone_is_diffuse(material, diffuse) -> None:
    assert shown_materials(a_scene(MATT, material).target).diffuse == diffuse


@pytest.mark.parametrize(
    ("material", "transparent"),
    [
        (MATT, False),
        (replace(MATT, opacity=0.99), True),
        (replace(MATT, opacity=textured(1.0, 1.0)), False),
        (replace(MATT, opacity=textured(1.0, 0.9)), True),
        (replace(MATT, opacity=textured(0.8, 0.9), opacity_threshold=0.5), False),
        (replace(MATT, opacity=textured(0.4, 0.9), opacity_threshold=0.5), True),
        (replace(MATT, opacity=Primvar(name="nowhere")), True),
    ],
)
def test_rays_go_on_through_what_is_clear_or_cut_out(material, transparent) -> None:
    assert shown_materials(a_scene(MATT, material).target).transparent == transparent


def test_what_shines_is_emissive_unless_it_is_black_everywhere() -> None:
    assert shown_materials(a_scene(MATT, GLOWING).target).emissive
    black = replace(MATT, emissive_color=textured((0.0, 0, 0), (0, 0, 0.0)))
    assert not shown_materials(a_scene(MATT, black).target).emissive


def test_only_faces_that_show_a_material_count() -> None:
    values = np.ones((4, 3, 1), np.float32)
    values[0] = 0.5
    clear = replace(MATT, path="/clear", opacity=Primvar(name="opacity"))
    for first, transparent in ((MATT, False), (clear, True)):
        scene = a_scene(first, MATT if first is clear else clear, primvars={"opacity": values})
        assert shown_materials(scene.target).transparent == transparent
    unseen = replace(scene.target, materials=(*scene.target.materials[1:], MATT, replace(METAL, opacity=0.5)))
    assert shown_materials(unseen).diffuse
