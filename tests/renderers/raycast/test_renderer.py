"""The preview's light, worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.renderers.raycast import renderer
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.material import Material
from tests.cases.scenes import box, pose, scene, soup, target

RADIANCE = 1e-6  # relative: float32 of the result
SILHOUETTE = 0.02  # relative: area of a triangle counted by 64 rays for each of 2,000 pixels of its rim

CASTER = EmbreeCaster()
RENDERER = RaycastRenderer(caster=CASTER)
WHITE = Material(path="/white", diffuse_color=(1, 1, 1))
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
SQUARE_FACES = np.array([[0, 2, 1], [0, 3, 2]])  # seen from -z


def test_nothing_in_view_is_an_empty_picture() -> None:
    s = scene(target(*box()), T_cam_body=pose(t=(0, 0, -5)))
    assert RENDERER.radiance(s, Effort(samples=2), seed=0).rgb.shape == (0, 0, 3)


def sun(direction, irradiance=(1361.0, 1361.0, 1361.0)):
    return DistantLight(path="/sun", direction_cam=tuple(np.array(direction) / np.linalg.norm(direction)), irradiance=irradiance)  # fmt: skip  # noqa: E501


def lit_square(material=WHITE, **kwargs):
    return scene(target(SQUARE, SQUARE_FACES, materials=(material,)), **kwargs)


def middle(s, samples=1):
    radiance = RENDERER.radiance(s, Effort(samples=samples), seed=1)
    rows, columns = radiance.region.shape
    return radiance.rgb[rows // 2, columns // 2].astype(float)


@pytest.mark.parametrize("degrees", [0, 30, 60, 85])
@pytest.mark.parametrize("material", [WHITE, Material(path="/c", diffuse_color=(0.2, 0.5, 0.7))])
def test_a_matt_plate_reflects_by_lamberts_law(degrees, material) -> None:
    angle = np.radians(degrees)
    light = sun((np.sin(angle), 0, np.cos(angle)), (1361.0, 100.0, 1.0))
    expected = np.array(light.irradiance) * material.diffuse_color * np.cos(angle) / np.pi
    np.testing.assert_allclose(middle(lit_square(material, lights=[light])), expected, rtol=RADIANCE)


def test_lights_add_and_emission_needs_none() -> None:
    lights = [sun((0, 0, 1)), sun((1, 0, 1), (1.0, 2.0, 3.0))]
    glowing = replace(WHITE, emissive_color=(4.0, 5.0, 6.0))
    alone = [middle(lit_square(lights=[light])) for light in lights]
    np.testing.assert_allclose(middle(lit_square(glowing)), (4, 5, 6), rtol=RADIANCE)
    np.testing.assert_allclose(middle(lit_square(glowing, lights=lights)), np.add(sum(alone), (4, 5, 6)), rtol=RADIANCE)


def test_light_from_behind_does_not_shine_through() -> None:
    np.testing.assert_array_equal(middle(lit_square(lights=[sun((0, 0, -1))])), 0)
    np.testing.assert_array_equal(middle(lit_square(lights=[sun((1, 0, -1e-6))])), 0)


def test_metals_are_not_black() -> None:
    gold = Material(path="/gold", diffuse_color=(1, 0.8, 0.3), metallic=1.0)
    specular = Material(path="/s", diffuse_color=(0, 0, 0), specular_color=(1, 0.8, 0.3), use_specular_workflow=True)
    for material in (gold, specular):
        colour = middle(lit_square(material, lights=[sun((0, 0, 1), (np.pi,) * 3)]))
        np.testing.assert_allclose(colour, (1, 0.8, 0.3), rtol=RADIANCE)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_shadows_are_hard_and_where_they_belong(size) -> None:
    """A small plate above a large one, the Sun at 45 degrees: its shadow is the plate itself, moved aside."""
    small, height = 0.2, 0.5
    points = np.concatenate([SQUARE, SQUARE * small - (0, 0, height)]) * size
    faces = np.concatenate([SQUARE_FACES, SQUARE_FACES + 4])
    s = scene(
        target(points, faces, parts=np.array([1, 1, 2, 2]), materials=(WHITE,)),
        T_cam_body=pose(t=np.array((0, 0, 4)) * size),
        lights=[sun((1, 0, 1))],
    )
    surface = visible_surface(s, CASTER.visibility(s))
    lit = (
        RENDERER.radiance(s, Effort(samples=1), seed=0).rgb[
            surface.rows - s.region.y0, surface.columns - s.region.x0, 0
        ]
        > 0
    )
    x, y = surface.body[:, 0] / size - height, surface.body[:, 1] / size
    shaded = (surface.part == 1) & (np.abs(x) < small) & (np.abs(y) < small)
    rim = (surface.part == 1) & (np.abs(np.maximum(np.abs(x), np.abs(y)) - small) < 1e-3)
    assert shaded.sum() > 20
    np.testing.assert_array_equal(lit[~rim], ~shaded[~rim])


def test_a_round_body_does_not_shade_itself() -> None:
    """No speckles: on a faceted sphere with smooth normals all that faces the Sun is lit."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    normals = np.asarray(ball.vertices)[ball.faces]
    s = scene(target(ball.vertices, ball.faces, corner_normals=normals, materials=(WHITE,)), lights=[sun((0, 0, 1))])
    surface = visible_surface(s, CASTER.visibility(s))
    rgb = RENDERER.radiance(s, Effort(samples=1), seed=0).rgb[surface.rows - s.region.y0, surface.columns - s.region.x0]
    facing = surface.body[:, 2] < -0.1
    assert facing.sum() > 500
    expected = -surface.body[facing, 2] / np.linalg.norm(surface.body[facing], axis=1) * 1361 / np.pi
    np.testing.assert_allclose(rgb[facing, 0], expected, rtol=0.02)


def test_samples_fill_the_pixel() -> None:
    """The light gathered from a small glowing triangle is that of its exact area."""
    corners = np.array([[-0.31, -0.22, 0], [0.17, 0.33, 0], [0.27, -0.19, 0]])
    camera = Camera(width=24, height=24, fx=30, fy=30, cx=12, cy=12)
    glowing = Material(path="/g", diffuse_color=(0, 0, 0), emissive_color=(1.0, 1.0, 1.0))
    s = scene(target(corners, [[0, 1, 2]], materials=(glowing,)), camera=camera)
    a, b = (corners[1:] - corners[0])[:, :2] * camera.fx / 4
    area = abs(a[0] * b[1] - a[1] * b[0]) / 2
    total = RENDERER.radiance(s, Effort(samples=64), seed=3).rgb[..., 0].sum()
    assert total == pytest.approx(area, rel=SILHOUETTE)


def test_the_seed_decides_the_samples() -> None:
    points, faces, parts = soup(4)
    s = scene(target(points, faces, parts=parts, materials=(WHITE,)), lights=[sun((0.3, 0.2, 1))])
    first, again, other = (RENDERER.radiance(s, Effort(samples=4), seed=seed).rgb for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_how_many_samples_are_cast_together_changes_no_bit(monkeypatch) -> None:
    points, faces, parts = soup(4)
    s = scene(target(points, faces, parts=parts, materials=(WHITE,)), lights=[sun((0.3, 0.2, 1))])
    together = RENDERER.radiance(s, Effort(samples=5), seed=1)
    monkeypatch.setattr(renderer, "BAND_PIXELS", 1)
    np.testing.assert_array_equal(RENDERER.radiance(s, Effort(samples=5), seed=1).groups, together.groups)


def test_one_sample_is_the_pixel_centre() -> None:
    """Then the preview shows exactly what the labels describe."""
    points, faces, parts = soup(4)
    s = scene(target(points, faces, parts=parts, materials=(replace(WHITE, emissive_color=(1, 1, 1)),)))
    bright = RENDERER.radiance(s, Effort(samples=1), seed=9).rgb[..., 0] > 0
    np.testing.assert_array_equal(bright, CASTER.visibility(s).face >= 0)


def test_versions_name_what_decides() -> None:
    assert set(RENDERER.versions()) == {"embreex"}
