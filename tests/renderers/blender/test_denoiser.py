"""Denoised pictures are nearer to the truth, keep the light, leak none, and depend on nothing but their own noise."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.region import Region
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.blender.denoiser import CLEAN_FROM, Denoiser
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import DENOISERS, Effort
from spin_usd.scene.light import DistantLight, RectLight
from spin_usd.scene.material import Material
from spin_usd.scene.passes import Radiance
from tests.cases import scenes

QUALITIES = DENOISERS[1:]
SAMPLES, CONVERGED = 4, 512
GAIN = 5.0  # in mean squared error, at least; ten times are usual at so few samples
CLEAN_GAIN = 3.0  # likewise, at CLEAN_FROM samples, which have less to gain
LIGHT = 0.03  # relative, of all that the target sends out: the noise of so few samples over some thousand pixels
SUMMED = 1e-5  # relative, of float32 sums
CAMERA = replace(scenes.SMALL, fx=90.0, fy=90.0, cx=32.0, cy=24.0, distortion=(0.0,) * 5)
METAL = Material(path="/metal", diffuse_color=(0.6, 0.5, 0.4), metallic=0.9, roughness=0.5)


@pytest.fixture(scope="module")
def noisy(make_scene):
    """Rough metal under a Sun and a large lamp, in unit light."""
    there = Transform(to="cam", of="panel", rotation=np.diag([1.0, -1, -1]), translation=np.array([-1.5, 1.0, 1.0]))
    lights = (
        DistantLight(path="/Sun", direction_cam=(0.6, 0.0, 0.8), irradiance=(1361.0,) * 3, angle=0.0093),
        RectLight(path="/Panel", width=1.5, height=1.5, T_cam_light=there, emission=(300.0,) * 3),
    )
    made = make_scene(*scenes.boxes(), camera=CAMERA, q=(0.9, 0.3, 0.2, 0.1), materials=[METAL], lights=lights)
    return in_unit_light(made).scene


@pytest.fixture(scope="module")
def converged(blender, noisy):
    return blender.radiance(noisy, Effort(samples=CONVERGED), seed=9)


def render(blender, scene, denoiser="none", samples=SAMPLES):
    return blender.radiance(scene, Effort(samples=samples, denoiser=denoiser), seed=1)


@pytest.mark.parametrize("quality", QUALITIES)
def test_each_group_is_nearer_to_the_truth_and_as_bright(blender, noisy, converged, quality) -> None:
    plain, denoised = render(blender, noisy), render(blender, noisy, quality)
    for before, after, truth in zip(plain.groups, denoised.groups, converged.groups, strict=True):
        assert np.square(after - truth).mean() < np.square(before - truth).mean() / GAIN
        assert after.sum() == pytest.approx(before.sum(), rel=SUMMED)
    assert denoised.rgb.sum() == pytest.approx(converged.rgb.sum(), rel=LIGHT)


@pytest.mark.parametrize("quality", QUALITIES)
def test_coverage_stays_and_no_light_leaves_it(blender, noisy, quality) -> None:
    plain, denoised = render(blender, noisy), render(blender, noisy, quality)
    np.testing.assert_array_equal(denoised.coverage, plain.coverage)
    assert not denoised.groups[:, denoised.coverage == 0].any()
    assert denoised.groups.min() >= 0


def test_qualities_differ_and_leave_nothing_behind(blender, noisy) -> None:
    """In any order, between labels and other scenes, with any number of threads."""
    import bpy

    other = replace(noisy, lights=noisy.lights[:1], camera=replace(CAMERA, width=40, height=44, cx=20.0))
    cases = [(noisy, quality) for quality in DENOISERS] + [
        (other, "fast"),
        *((noisy, q, CLEAN_FROM) for q in QUALITIES),
    ]
    first = [render(blender, *case).groups.tobytes() for case in cases]
    assert len(set(first)) == len(first)
    for index in (3, 4, 1, 5, 1, 7, 0, 2, 3, 6, 7):
        blender.visibility(other)
        bpy.context.scene.render.threads_mode = "FIXED" if index % 2 else "AUTO"
        bpy.context.scene.render.threads = 1
        try:
            assert render(blender, *cases[index]).groups.tobytes() == first[index]
        finally:
            bpy.context.scene.render.threads_mode = "AUTO"


@pytest.mark.parametrize("quality", QUALITIES)
def test_guides_that_count_as_clean_bring_it_nearer_to_the_truth(blender, noisy, converged, quality) -> None:
    plain, denoised = (render(blender, noisy, each, samples=CLEAN_FROM).groups for each in ("none", quality))
    assert np.square(denoised - converged.groups).mean() < np.square(plain - converged.groups).mean() / CLEAN_GAIN


def test_bands_leave_no_seams(blender, noisy, monkeypatch) -> None:
    pictures = []
    for cost in (1e18, 0.0):  # one band; as many as there are
        monkeypatch.setattr("spin_usd.renderers.crop.BAND_COST_SAMPLES", cost)
        pictures.append(render(blender, noisy, "balanced").groups)
    np.testing.assert_array_equal(*pictures)


def test_a_target_without_light_stays_dark(blender, noisy) -> None:
    dark = render(blender, replace(noisy, lights=()), "fast")
    assert dark.groups.shape == (0, *noisy.picture_region.shape, 3)
    unseen = replace(noisy.lights[0], lights=frozenset())
    shaded = render(blender, replace(noisy, lights=(unseen, noisy.lights[1])), "fast")
    assert [bool(group.any()) for group in shaded.groups] == [False, True]


@pytest.fixture
def denoiser(blender, tmp_path):
    return Denoiser(tmp_path)


def picture(shape, groups, seed=0):
    """Radiance and guides of random numbers."""
    rng = np.random.default_rng(seed)
    lit, guides = (rng.random((count, *shape, 3), np.float32) for count in (groups, 2))
    region = Region.full(shape[1], shape[0])
    return Radiance(region=region, groups=lit, coverage=np.ones(shape, np.float32)), guides


def test_each_group_is_denoised_by_itself(denoiser) -> None:
    """And none is taken for one of the picture before, of the same size."""
    noisy, guides = picture((20, 30), groups=3)
    together = denoiser.denoised(noisy, guides, "balanced", samples=SAMPLES).groups
    for index in (2, 0, 1):
        alone = denoiser.denoised(
            replace(noisy, groups=noisy.groups[index : index + 1]), guides, "balanced", samples=SAMPLES
        ).groups
        np.testing.assert_array_equal(alone[0], together[index])


@pytest.mark.parametrize("quality", QUALITIES)
def test_guides_count_as_clean_from_so_many_samples_on(denoiser, quality) -> None:
    noisy, guides = picture((20, 30), groups=1)
    few, enough, many = (
        denoiser.denoised(noisy, guides, quality, samples=samples).groups
        for samples in (CLEAN_FROM - 1, CLEAN_FROM, 4 * CLEAN_FROM)
    )
    assert not np.array_equal(few, enough)
    np.testing.assert_array_equal(enough, many)


@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (1, 40), (17, 2)])
def test_pictures_may_be_very_small(denoiser, shape) -> None:
    noisy, guides = picture(shape, groups=2)
    denoised = denoiser.denoised(noisy, guides, "fast", samples=SAMPLES)
    assert denoised.groups.shape == noisy.groups.shape
    np.testing.assert_allclose(denoised.groups.sum((1, 2, 3)), noisy.groups.sum((1, 2, 3)), rtol=SUMMED)


def test_it_makes_smooth_what_is_noisy_the_right_way_up(denoiser) -> None:
    noisy, guides = picture((40, 30), groups=1)
    step = np.repeat([1.0, 9.0], 20)[:, None, None].astype(np.float32)
    lit = replace(noisy, groups=step * noisy.groups)
    found = denoiser.denoised(lit, np.broadcast_to(step / 10, guides.shape), "high", samples=SAMPLES).groups[0]
    assert found[:18].std() < lit.groups[0, :18].std() / 3
    assert found[22:].mean() == pytest.approx(9 * found[:18].mean(), rel=0.2)
