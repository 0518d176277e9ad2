"""A render of fewer pixels: the same rays' squares, the same light and area, back on the picture's own pixels."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.picture.make_picture import Stopwatch, render_in
from spin_usd.renderers.downscale import enlarged, reduced
from spin_usd.renderers.raycast.renderer import RaycastRenderer
from spin_usd.scene.derived.content_keys import RenderSettings
from spin_usd.scene.derived.light_groups import in_unit_light
from spin_usd.scene.effort import REDUCTIONS, Effort
from spin_usd.scene.light import DistantLight
from spin_usd.scene.passes import Radiance
from tests.cases import scenes

BY = REDUCTIONS[1:]
ROUNDING = 1e-5  # relative, of float32 sums
AREA = 0.02  # relative, of light and area by 64 rays a pixel
ODD = Camera(width=61, height=45, fx=70, fy=71, cx=31, cy=20, distortion=(-0.2, 0.05, 1e-3, 2e-3, 0))
SUN = DistantLight(path="/Sun", direction_cam=(0.0, 0.6, 0.8), irradiance=(1361.0,) * 3)
RAYCAST = RaycastRenderer()


def box(make_scene, *, size=1.0, t=(0.0, 0.0, 4.0), camera=ODD, **fields):
    points, faces = scenes.box()
    return make_scene(size * points, faces, camera=camera, q=(0.9, 0.3, 0.2, 0.1), t=t, lights=[SUN], **fields)


def render(renderer, scene, *, by, samples):
    effort = Effort(samples=samples, reduction=by)
    return render_in(in_unit_light(scene), renderer, RenderSettings(renderer="", effort=effort, seed=0), Stopwatch())


def total(radiance):
    """Red, green, blue and area (4,)."""
    return radiance.rgba.sum((0, 1), dtype=np.float64)


def made_of(scene, by, value):
    """The reduced radiance with `value` (rows, columns) of the reduced frame in one group, covered all over."""
    small = reduced(scene, by)
    region = small.picture_region
    lit = np.repeat(value[region.slices][None, ..., None], 3, -1).astype(np.float32)
    return Radiance(region=region, groups=lit, coverage=np.ones(region.shape, np.float32))


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("camera", [ODD, scenes.BARREL, scenes.SPEEDPLUS])
def test_pixels_stand_for_squares(make_scene, by, camera) -> None:
    small = reduced(box(make_scene, camera=camera), by).camera
    xy = np.random.default_rng(0).uniform(-0.2, 0.2, (50, 2))
    np.testing.assert_allclose(by * small.pixels(xy), camera.pixels(xy), atol=1e-9)
    for name in ("width", "height"):
        assert 0 <= by * getattr(small, name) - getattr(camera, name) < by


def test_one_for_one_is_the_render_itself(make_scene) -> None:
    scene = box(make_scene)
    assert reduced(scene, 1) is scene
    plain = RAYCAST.radiance(scene, Effort(samples=2), seed=0)
    assert enlarged(plain, scene, 1) is plain


@pytest.mark.parametrize("by", BY)
def test_what_is_linear_over_the_frame_stays_so_and_is_held_at_its_edges(make_scene, by) -> None:
    scene = box(make_scene, size=30.0, t=(0.0, 0.0, 9.0))  # fills the frame
    camera = reduced(scene, by).camera
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    assert scene.picture_region == scene.camera.frame
    full_u, full_v = np.meshgrid(np.arange(61) + 0.5, np.arange(45) + 0.5)
    held_u = np.clip(full_u / by, 0.5, camera.width - 0.5)
    held_v = np.clip(full_v / by, 0.5, camera.height - 0.5)
    found = enlarged(made_of(scene, by, 3 + 2 * u - v), scene, by)
    np.testing.assert_allclose(found.groups[0, ..., 1], 3 + 2 * held_u - held_v, rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_allclose(found.coverage, 1, rtol=ROUNDING)


@pytest.mark.parametrize("by", BY)
@pytest.mark.parametrize("size", [0.02, 0.2, 1.0])
def test_light_and_area_are_kept_however_small_the_target(make_scene, by, size) -> None:
    """From half a pixel to half the frame, anywhere in it."""
    rng = np.random.default_rng(int(100 * size))
    for _ in range(4):
        scene = box(make_scene, size=size, t=(*rng.uniform(-0.8, 0.8, 2), 4.0), camera=scenes.SMALL)
        small = RAYCAST.radiance(reduced(scene, by), Effort(samples=64), seed=0)
        found = enlarged(small, scene, by)
        assert found.region == scene.picture_region
        assert found.coverage.max() <= 1
        assert total(found) == pytest.approx(by**2 * total(small), rel=ROUNDING)


def test_a_target_within_the_last_square_but_out_of_the_frame_is_not_there(make_scene) -> None:
    scene = box(make_scene, size=0.02, t=(0.0, 0.0, 4.0), camera=replace(ODD, cx=63.5, distortion=(0.0,) * 5))
    assert scene.picture_region.empty
    assert not reduced(scene, 8).picture_region.empty
    assert render(RAYCAST, scene, by=8, samples=1).region == scene.picture_region


@pytest.mark.parametrize("name", ["blender", "raycast"])
def test_both_renderers_come_near_the_picture(request, make_scene, name) -> None:
    renderer = RAYCAST if name == "raycast" else request.getfixturevalue("blender")
    scene = box(make_scene)
    true = render(renderer, scene, by=1, samples=64)
    errors = []
    for by in BY:
        found = render(renderer, scene, by=by, samples=64)
        assert found.region == true.region
        assert total(found) == pytest.approx(total(true), rel=AREA)
        errors.append(np.square(found.rgba - true.rgba).mean() / np.square(true.rgba).mean())
    assert errors == sorted(errors)
    assert errors[0] < 0.03


def test_blender_renders_frames_of_a_square_or_two(blender, make_scene) -> None:
    camera = replace(ODD, width=16, height=9, fx=18.0, fy=18.0, cx=8.0, cy=4.5, distortion=(0.0,) * 5)
    few, many = (render(blender, box(make_scene, camera=camera), by=by, samples=64) for by in (8, 1))
    assert total(few) == pytest.approx(total(many), rel=0.1)
