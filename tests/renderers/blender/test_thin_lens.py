"""Depth of field against the formulas of the thin lens; the labels never know of it."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.camera_shader import View
from spin_usd.scene.effort import Effort
from spin_usd.scene.material import Material
from spin_usd.scene.scene import ThinLens

GLOWING = Material(path="/glowing", diffuse_color=(0, 0, 0), emissive_color=(1, 1, 1), use_specular_workflow=True)
CAMERA = Camera(width=64, height=48, fx=64, fy=64, cx=32, cy=24)
RADIUS_PX = 4.0
EDGE_PX = 0.008  # share of a pixel: noise of 1024 samples along an edge, averaged over 20 rows
ENERGY = 1e-3  # relative: noise of 1024 samples
MOMENT = 0.02  # relative: noise of a second moment
SAMPLES = 1024


@pytest.fixture(params=["near", "far"])
def glowing_square(request, make_scene, square):
    """A glowing square 32 px wide in the middle of the picture; rays start at the camera, or at the target."""
    z = 4.0 if request.param == "near" else 400.0
    camera = replace(CAMERA, fx=16 * z, fy=16 * z)
    scene = make_scene(*square, camera=camera, t=(0, 0, z), materials=[GLOWING])
    assert View.sharp(scene).near == (request.param == "near")
    return scene


def defocused(scene, radius_px, focus):
    """The scene through a lens focussed at `focus`, metres, that blurs what lies at the target's depth so far."""
    z, f = scene.T_cam_body.translation[2], scene.camera.fx
    return replace(scene, thin_lens=ThinLens(radius=radius_px / f / abs(1 / z - 1 / focus), focus=focus))


def edge_profile(distance, radius):
    """Share of a uniform disk of `radius` that lies on one side of a line `distance` from its centre, averaged over a
    pixel around each distance."""
    fine = np.asarray(distance)[:, None] + (np.arange(200) + 0.5) / 200 - 0.5
    d = np.clip(fine / radius, -1, 1)
    return (0.5 + (d * np.sqrt(1 - d * d) + np.arcsin(d)) / np.pi).mean(1)


def coverage(blender, scene, samples=SAMPLES):
    """(rows, columns) of the whole frame."""
    picture = blender.radiance(scene, Effort(samples=samples), seed=3)
    frame = np.zeros(scene.camera.frame.shape)
    frame[picture.region.slices] = picture.rgba[..., 3]
    return frame


@pytest.mark.parametrize("focus", [0.5, 2.0, 1e6])
def test_an_edge_out_of_focus_is_that_of_a_uniform_disk(blender, glowing_square, focus) -> None:
    """In front of the plane of focus and behind it; the square's left edge lies at column 16, its right one at 48."""
    z = glowing_square.T_cam_body.translation[2]
    found = coverage(blender, defocused(glowing_square, RADIUS_PX, focus * z))[14:34].mean(0)
    columns = np.arange(CAMERA.width) + 0.5
    wanted = np.minimum(edge_profile(columns - 16, RADIUS_PX), edge_profile(48 - columns, RADIUS_PX))
    assert np.abs(found - wanted).max() < EDGE_PX


def test_in_focus_it_is_as_sharp_as_a_pinhole(blender, glowing_square) -> None:
    z = glowing_square.T_cam_body.translation[2]
    found = coverage(blender, replace(glowing_square, thin_lens=ThinLens(radius=0.1 * z, focus=z)), samples=16)
    assert np.array_equal(found, coverage(blender, glowing_square, samples=16))
    assert found.sum() == 32**2  # edges fall between pixels


def test_a_point_becomes_a_disk_and_keeps_its_energy(blender, glowing_square) -> None:
    """Second moment of a uniform disk along an axis: radius**2 / 4; of a square or pixel of side 1: 1/12."""
    z, side = glowing_square.T_cam_body.translation[2], 2.0
    small = replace(glowing_square, camera=replace(glowing_square.camera, fx=side / 2 * z, fy=side / 2 * z))
    found = coverage(blender, defocused(small, 6.0, 3 * z), samples=4 * SAMPLES)
    columns, rows = np.arange(64) + 0.5 - 32, np.arange(48) + 0.5 - 24
    wanted = 6.0**2 / 4 + side**2 / 12 + 1 / 12
    assert np.isclose(found.sum(), side**2, rtol=MOMENT)
    assert np.isclose((found * columns**2).sum() / found.sum(), wanted, rtol=MOMENT)
    assert np.isclose((found * rows[:, None] ** 2).sum() / found.sum(), wanted, rtol=MOMENT)


def test_energy_is_kept(blender, glowing_square) -> None:
    z = glowing_square.T_cam_body.translation[2]
    found = coverage(blender, defocused(glowing_square, RADIUS_PX, z / 2), samples=SAMPLES)
    assert np.isclose(found.sum(), 32**2, rtol=ENERGY)


def test_near_and_far_form_are_one_picture(blender, make_scene, needles, speedplus, monkeypatch) -> None:
    """The same scene, rays once started at the camera and once at the target: a lens, distortion, depth."""
    scene = make_scene(*needles, camera=speedplus, q=(0.5, -0.3, 0.7, 0.2), t=(1, -0.5, 12))
    scene = defocused(scene, 3.0, 9.0)
    near = coverage(blender, scene, samples=64)
    monkeypatch.setattr("spin_usd.renderers.camera_shader.NEAR_RADII", 2.0)
    far = coverage(blender, scene, samples=64)
    assert not View.blurred(scene).near
    assert near.max() == 1
    assert np.abs(near - far).max() < 2 / 64  # the same rays, but for float32: a sample or two that graze an edge


def test_labels_never_know_of_the_lens(blender, make_scene, needles, speedplus) -> None:
    far = replace(speedplus, fx=1e3 * speedplus.fx, fy=1e3 * speedplus.fy, distortion=(0.0,) * 5)
    for z, camera in ((4, speedplus), (4000, far)):
        scene = make_scene(*needles, camera=camera, q=(0.5, -0.3, 0.7, 0.2), t=(0.1, 0, z))
        blurred = defocused(scene, 5.0, z / 2)
        labels, picture = blender.visibility(scene).face, blender.radiance(scene, Effort(samples=4), seed=1).rgba
        through = blender.radiance(blurred, Effort(samples=4), seed=1)
        assert (labels >= 0).any()
        assert np.array_equal(blender.visibility(blurred).face, labels)
        assert np.array_equal(blender.radiance(blurred, Effort(samples=4), seed=1).rgba, through.rgba)
        assert np.array_equal(blender.radiance(scene, Effort(samples=4), seed=1).rgba, picture)


def test_nothing_is_drawn_outside_the_picture_region(blender, make_scene, needles, speedplus, monkeypatch) -> None:
    """The whole frame, rendered in one piece, holds the bands' pixels and nothing else; the region is tight."""
    lens = ThinLens(radius=0.25, focus=2.5)  # 20 px
    scene = make_scene(*needles, camera=speedplus, q=(0.5, -0.3, 0.7, 0.2), t=(0.2, 0.1, 8))
    scene = replace(scene, thin_lens=lens)
    in_bands, region = coverage(blender, scene, samples=64), scene.picture_region
    monkeypatch.setattr(type(scene), "picture_region", property(lambda self: self.camera.frame))
    monkeypatch.setattr(
        "spin_usd.renderers.blender.renderer.picture_bands", lambda scene, samples: [scene.camera.frame]
    )
    whole = coverage(blender, scene, samples=64)
    assert np.array_equal(whole, in_bands)
    rows, columns = np.nonzero(whole)
    found = np.array([columns.min(), rows.min(), -columns.max() - 1, -rows.max() - 1])
    slack = found - (region.x0, region.y0, -region.x1, -region.y1)
    assert slack.min() >= 0
    assert slack.max() <= 8  # padding, and what few samples miss at the rim of a disk
