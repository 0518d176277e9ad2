"""What each setting of an effort does to Cycles' picture, alone and after a render with other settings."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.transform import Transform
from spin_usd.renderers.blender.passes import COMBINED
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DistantLight, RectLight
from spin_usd.scene.material import Material
from tests.cases import scenes

CAMERA = replace(scenes.SMALL, fx=90.0, fy=90.0, cx=32.0, cy=24.0, distortion=(0.0,) * 5)
MATT = Material(path="/matt", diffuse_color=(0.8, 0.8, 0.8), use_specular_workflow=True)
METAL = Material(path="/metal", diffuse_color=(0.6, 0.5, 0.4), metallic=0.9, roughness=0.5)
ROUNDING = 1e-5  # relative, of float32 sums of many samples
FURNACE_NOISE = 0.01  # relative, of the mean over some hundred pixels of 64 samples
LOOK = 16  # samples between two looks of adaptive sampling
NOISE = 0.03  # threshold at which it stops


def sun(irradiance=1361.0):
    direction = np.array([0.5, 0.4, 0.8]) / np.linalg.norm([0.5, 0.4, 0.8])
    return DistantLight(path="/Sun", direction_cam=tuple(direction), irradiance=(irradiance,) * 3)


def panel():
    """A square lamp of 1.5 m beside the camera that shines along its axis."""
    there = Transform(to="cam", of="panel", rotation=np.diag([1.0, -1, -1]), translation=np.array([-1.5, 1.0, 1.0]))
    return RectLight(path="/Panel", width=1.5, height=1.5, T_cam_light=there, emission=(300.0,) * 3)


@pytest.fixture(scope="module")
def parts(make_scene):
    """Two boxes in front of a plate, of one material, in unit light."""

    def make(material, *lights, **fields):
        fixed = {"camera": CAMERA, "q": (0.9, 0.3, 0.2, 0.1), "materials": [material], "lights": lights}
        return in_unit_light(make_scene(*scenes.boxes(), **fixed, **fields)).scene

    return make


def render(blender, scene, *, seed=1, **effort):
    return blender.radiance(scene, Effort(**effort), seed=seed)


def assert_comes_and_goes(blender, scene, usual, **change):
    """The change alters the picture when it alone changed, and leaves nothing behind; returns both pictures."""
    first, changed, again = (render(blender, scene, **{**usual, **extra}) for extra in ({}, change, {}))
    assert not np.array_equal(changed.rgba, first.rgba)
    np.testing.assert_array_equal(again.rgba, first.rgba)
    np.testing.assert_array_equal(render(blender, scene, **{**usual, **change}).rgba, changed.rgba)
    return first, changed


class TestAdaptive:
    def test_each_pixel_is_that_of_fewer_samples_fewest_where_it_is_smooth(self, blender, parts) -> None:
        scene = parts(METAL, sun(), panel())
        plain = [render(blender, scene, samples=count).groups for count in range(LOOK, 5 * LOOK, LOOK)]
        picture = render(blender, scene, samples=4 * LOOK, adaptive=NOISE)
        off = np.stack([np.abs(picture.groups - groups).max((0, -1)) for groups in plain])
        assert off.min(0).max() <= ROUNDING * picture.groups.max()
        took = off.argmin(0)[picture.coverage == 1]
        assert {0, len(plain) - 1} <= set(took.tolist())
        contrast = np.abs(plain[-1] - plain[0]).sum((0, -1))[picture.coverage == 1]  # how far the first had to go
        assert contrast[took == 0].mean() < contrast[took > 0].mean() / 2

    def test_it_takes_effect_after_a_render_without_it(self, blender, parts) -> None:
        assert_comes_and_goes(blender, parts(METAL, sun(), panel()), {"samples": 4 * LOOK}, adaptive=NOISE)

    def test_it_does_not_depend_on_threads(self, blender, parts) -> None:
        import bpy

        scene, effort = parts(METAL, sun(), panel()), {"samples": 4 * LOOK, "adaptive": NOISE}
        first = render(blender, scene, **effort).rgba
        bpy.context.scene.render.threads_mode, bpy.context.scene.render.threads = "FIXED", 1
        try:
            np.testing.assert_array_equal(render(blender, scene, **effort).rgba, first)
        finally:
            bpy.context.scene.render.threads_mode = "AUTO"

    def test_groups_add_up(self, blender, parts, monkeypatch) -> None:
        scene, effort = parts(METAL, sun(), panel()), {"samples": 4 * LOOK, "adaptive": NOISE}
        apart = render(blender, scene, **effort)
        monkeypatch.setattr("spin_usd.renderers.blender.renderer.group_names", lambda groups: ["all"])
        monkeypatch.setattr("spin_usd.renderers.blender.renderer.pass_name", lambda group: COMBINED)
        whole = render(blender, scene, **effort)
        np.testing.assert_array_equal(apart.coverage, whole.coverage)
        np.testing.assert_allclose(apart.rgb, whole.rgb, rtol=ROUNDING, atol=ROUNDING * whole.rgb.max())

    @pytest.mark.parametrize("lights", [(sun(), panel()), ()])
    def test_coverage_is_no_worse_than_that_of_the_samples_before_the_first_look(self, blender, parts, lights) -> None:
        """Also of a target without light, whose pixels all stop there."""
        scene = parts(METAL, *lights)
        true = render(blender, scene, samples=1024, bounces=0, seed=7).coverage
        edge = (true > 0) & (true < 1)
        least, found = (
            (render(blender, scene, samples=count, adaptive=adaptive).coverage - true)[edge]
            for count, adaptive in ((LOOK, 0.0), (8 * LOOK, 0.1))
        )
        assert np.square(found).mean() <= 1.05 * np.square(least).mean()
        assert np.abs(found.mean()) < 3 * least.std() / np.sqrt(edge.sum())


def test_bounces_are_the_terms_of_a_geometric_series(blender, make_scene) -> None:
    """Within a closed box whose walls glow with 1 and reflect half, each bounce adds half of what the last added. The
    glowing wall that is seen is the first term, another's light by way of it the second."""
    wall = replace(MATT, diffuse_color=(0.5,) * 3, emissive_color=(1.0,) * 3)
    points, faces = scenes.box()
    scene = make_scene(
        points, faces[:, ::-1], camera=replace(CAMERA, width=24, height=16), materials=[wall], t=(0, 0, 0)
    )
    for bounces in (0, 1, 3, 0):
        seen = render(blender, scene, samples=64, bounces=bounces).rgb.mean()
        assert seen == pytest.approx(2 - 0.5 ** (bounces + 1), rel=FURNACE_NOISE)


def test_light_tree_takes_effect_when_it_alone_changes(blender, parts) -> None:
    on, off = assert_comes_and_goes(blender, parts(MATT, sun(), panel()), {"samples": 64}, light_tree=False)
    assert on.rgb.mean() == pytest.approx(off.rgb.mean(), rel=0.01)


def test_clamp_limits_each_indirect_contribution_and_nothing_else(blender, parts) -> None:
    """With one sample, one bounce and a Sun that is a point there is one such contribution a pixel."""
    scene, clamp = parts(MATT, sun()), 0.05
    once = {"samples": 1, "bounces": 1}
    direct = render(blender, scene, samples=1, bounces=0).rgb
    free, held = assert_comes_and_goes(blender, scene, once, clamp=clamp)
    indirect = free.rgb - direct
    assert (indirect > 2 * clamp).any()
    np.testing.assert_allclose(held.rgb - direct, np.minimum(indirect, clamp), atol=ROUNDING)
    np.testing.assert_array_equal(held.coverage, free.coverage)


def test_the_glossy_filter_makes_reflections_of_the_sun_in_others_less_noisy_and_nothing_else(blender, parts) -> None:
    scene = parts(replace(METAL, roughness=0.2), sun())
    free, filtered = assert_comes_and_goes(blender, scene, {"samples": 16}, filter_glossy=1.0)
    again = [render(blender, scene, samples=16, seed=2, filter_glossy=each) for each in (0.0, 1.0)]
    noise = [np.square(one.rgb - two.rgb).mean() for one, two in zip((free, filtered), again, strict=True)]
    assert noise[1] < noise[0] / 2
    np.testing.assert_array_equal(filtered.coverage, free.coverage)
    seen = [render(blender, scene, samples=16, bounces=0, filter_glossy=each).rgb for each in (0.0, 1.0)]
    np.testing.assert_array_equal(*seen)


WHOLE = [{"samples": 4}, {"samples": 32, "adaptive": NOISE}, {"samples": 2, "denoiser": "fast"}]


@pytest.mark.parametrize("effort", WHOLE)
def test_the_whole_frame_holds_the_same_pixels(blender, parts, monkeypatch, effort) -> None:
    scene = parts(METAL, sun(), panel(), t=(0.2, -0.1, 6))
    cropped = render(blender, scene, **effort)
    assert cropped.region != scene.camera.frame
    monkeypatch.setattr(blender, "_crop", False)
    whole = render(blender, scene, **effort)
    assert whole.region == cropped.region
    np.testing.assert_array_equal(whole.groups, cropped.groups)
    np.testing.assert_array_equal(whole.coverage, cropped.coverage)
