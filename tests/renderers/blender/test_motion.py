"""Motion blur and the rolling shutter against formulas, and against the mean of still pictures."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.errors import GeometryError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.camera_shader import View
from spin_usd.renderers.downscale import enlarged, reduced
from spin_usd.scene.effort import Effort
from spin_usd.scene.material import Material
from tests.cases.scenes import in_motion, with_first

GLOWING = Material(path="/glowing", diffuse_color=(0, 0, 0), emissive_color=(1, 1, 1), use_specular_workflow=True)
CAMERA = Camera(width=64, height=48, fx=64, fy=64, cx=32, cy=24)
EDGE_PX = 0.004  # share of a pixel: noise of 1024 samples along an edge, averaged over 32 rows
ENERGY = 1e-3  # relative: noise of 1024 samples
ROW_PX = 0.04  # of a row's middle: four deviations of 1024 samples of a blurred edge, each side
ROWS_PX = 0.006  # of the mean of 32 such rows
SAMPLES = 1024


@pytest.fixture(params=["near", "far"])
def glowing_square(request, make_scene, square):
    """A glowing square 32 px wide in the middle of the picture; rays start at the camera, or at the target."""
    z = 4.0 if request.param == "near" else 400.0
    scene = make_scene(*square, camera=replace(CAMERA, fx=16 * z, fy=16 * z), t=(0, 0, z), materials=[GLOWING])
    assert View.sharp(scene).near == (request.param == "near")
    return scene


def moving(scene, *, along=(0, 0, 0), turn=(0, 0, 0), count=9, readout=0.0):
    """The scene with its target moving by `along` metres and turning by the rotation vector `turn` (camera axes, about
    the body's origin) while the shutter is open, half of it before the middle."""
    start = scene.T_cam_body

    def pose(share):
        rotation = Rotation.from_rotvec(share * np.array(turn, float)).as_matrix() @ start.rotation
        translation = start.translation + share * np.array(along, float)
        return Transform(to="cam", of="body", rotation=rotation, translation=translation)

    poses = [pose(share) for share in np.linspace(-0.5, 0.5, count)]
    poses[count // 2] = start
    return in_motion(scene, poses, readout=readout)


def magnified(camera, z):
    """The camera, with a longer focal length and no distortion where the target is further than 6 m away."""
    zoom = z / 6
    return replace(camera, fx=zoom * camera.fx, fy=zoom * camera.fy, distortion=(0.0,) * 5) if zoom > 1 else camera


def smaller(camera, k):
    """The camera with pixels `k` times as wide."""
    sizes = {"width": camera.width // k, "height": camera.height // k}
    return replace(camera, **sizes, **{name: getattr(camera, name) / k for name in ("fx", "fy", "cx", "cy")})


def metres(scene, pixels):
    """How far the target moves across `pixels`."""
    return pixels * scene.T_cam_body.translation[2] / scene.camera.fx


def coverage(blender, scene, samples=SAMPLES, seed=3):
    """(rows, columns) of the whole frame."""
    picture = blender.radiance(scene, Effort(samples=samples), seed=seed)
    frame = np.zeros(scene.camera.frame.shape)
    frame[picture.region.slices] = picture.rgba[..., 3]
    return frame


def ramp(distance, length):
    """Coverage of pixels whose centres lie `distance` inside an edge that moves over `length`, evenly in time."""
    edge = (np.arange(2000) + 0.5) / 2000 - 0.5
    return np.clip(np.asarray(distance)[:, None] - length * edge + 0.5, 0, 1).mean(1)


@pytest.mark.parametrize("length", [0.5, 5.0, 20.0])
def test_edges_of_a_moving_square_are_linear_ramps(blender, glowing_square, length) -> None:
    """Short exposures and long ones; the energy is that of the square at rest."""
    found = coverage(blender, moving(glowing_square, along=(metres(glowing_square, length), 0, 0)))
    columns = np.arange(CAMERA.width) + 0.5
    wanted = np.minimum(ramp(columns - 16, length), ramp(48 - columns, length))
    assert np.abs(found[8:40].mean(0) - wanted).max() < EDGE_PX
    assert np.isclose(found.sum(), 32**2, rtol=ENERGY)


def test_a_turning_square_is_round_and_keeps_its_energy(blender, glowing_square) -> None:
    """A quarter turn covers a point as long as a square at that angle does: at a distance r from its centre, between
    half its side and half its diagonal, 1 - 4/pi arccos(16/r) of the time."""
    found = coverage(blender, moving(glowing_square, turn=(0, 0, np.pi / 2), count=33))
    u, v = np.meshgrid(np.arange(64) + 0.5 - 32, np.arange(48) + 0.5 - 24)
    r = np.hypot(u, v)
    wanted = 1 - 4 / np.pi * np.arccos(np.clip(16 / r, None, 1))
    away = (np.abs(r - 16) > 1.5) & (np.abs(r - 16 * np.sqrt(2)) > 1.5)  # of where the formula bends within a pixel
    assert np.abs(found - np.clip(wanted, 0, 1))[away].max() < 0.05  # noise of one pixel
    assert np.abs(found - np.clip(wanted, 0, 1))[away].mean() < 0.005
    assert np.isclose(found.sum(), 32**2, rtol=ENERGY)


@pytest.mark.parametrize("z", [6, pytest.param(600, marks=pytest.mark.slow)])
def test_it_is_the_mean_of_still_pictures(blender, make_scene, needles, speedplus, z) -> None:
    """Approach, drift and tumbling together, near and far; the far one comes nearer by many times its own size."""
    camera = smaller(magnified(speedplus, z), 4)
    scene = make_scene(*needles, camera=camera, q=(0.5, -0.3, 0.7, 0.2), t=(0.3, -0.2, z))
    blurred = moving(scene, along=(0.4, 0.2, -z / 12), turn=(0.1, 0.3, -0.2), count=65)
    stills = [coverage(blender, with_first(scene, T_cam_body=pose), samples=16) for pose in blurred.poses]
    weights = np.array([0.5, *np.ones(63), 0.5]) / 64  # the trapezoid rule: poses at both ends count half
    wanted = np.tensordot(weights, stills, 1)
    assert View.blurred(blurred).near == (z == 6)
    found = coverage(blender, blurred)
    assert wanted.max() == 1
    assert np.abs(found - wanted).max() < 0.08  # one pixel's noise: four deviations of 1024 samples, and of 65 x 16
    assert np.abs(found - wanted).mean() < 0.003
    assert np.isclose(found.sum(), wanted.sum(), rtol=2 * ENERGY)


@pytest.mark.parametrize("readout", [1.0, 0.5])
def test_rolling_shutter_shears_a_moving_edge(blender, glowing_square, readout) -> None:
    """Row i of 48 is exposed around i/47 of the readout, whatever part of the frame is rendered."""
    length = 20.0
    scene = moving(glowing_square, along=(metres(glowing_square, length), 0, 0), readout=readout)
    found = coverage(blender, scene)[8:40]
    middle = (found * (np.arange(64) + 0.5)).sum(1) / found.sum(1) - 32
    wanted = (np.arange(8, 40) / 47 - 0.5) * readout * length
    assert np.abs(middle - wanted).max() < ROW_PX
    assert np.abs((middle - wanted).mean()) < ROWS_PX
    partial = ((found > 0.02) & (found < 0.98)).sum(1)  # each row's own blur, both edges
    assert partial.mean() == pytest.approx(2 * (1 - readout) * length + 1, abs=3)


@pytest.mark.parametrize("by", [2, 4])
def test_a_reduced_render_opens_its_rows_when_the_pictures_own_would(blender, glowing_square, by) -> None:
    """What is sheared evenly stays so between the rows that were rendered."""
    length, readout = 20.0, 0.5
    scene = moving(glowing_square, along=(metres(glowing_square, length), 0, 0), readout=readout)
    small = blender.radiance(reduced(scene, by), Effort(samples=SAMPLES), seed=3)
    found, rows = enlarged(small, scene, by), np.arange(14, 34)
    columns = np.arange(found.region.x0, found.region.x1) + 0.5
    lit = found.coverage[rows - found.region.y0]
    off = (lit * columns).sum(1) / lit.sum(1) - 32 - (rows / 47 - 0.5) * readout * length
    assert np.abs(off).max() < by * ROW_PX
    assert abs(off.mean()) < by * ROWS_PX


def test_labels_are_those_of_the_middle_at_rest(blender, make_scene, needles, speedplus) -> None:
    """Bit by bit, in whatever order pictures are taken; and what is at rest is not blurred by what moved before."""
    for z in (4, 4000):
        scene = make_scene(*needles, camera=magnified(speedplus, z), q=(0.5, -0.3, 0.7, 0.2), t=(0.1, 0, z))
        blurred = moving(scene, along=(0.3, 0, 0), turn=(0, 0.2, 0))
        rolling = replace(blurred, shutter=replace(blurred.shutter, readout=0.5))
        labels, at_rest = blender.visibility(scene).face, blender.radiance(scene, Effort(samples=4), seed=1).rgba
        pictures = [blender.radiance(s, Effort(samples=4), seed=1).rgba for s in (blurred, rolling)]
        assert not np.array_equal(*pictures)
        for moved, picture in zip((blurred, rolling), pictures, strict=True):
            assert np.array_equal(blender.visibility(moved).face, labels)
            assert np.array_equal(blender.radiance(moved, Effort(samples=4), seed=1).rgba, picture)
        assert np.array_equal(blender.radiance(scene, Effort(samples=4), seed=1).rgba, at_rest)
        assert np.array_equal(blender.visibility(scene).face, labels)


def test_a_shutter_without_motion_changes_no_pixel(blender, glowing_square) -> None:
    still = moving(glowing_square)
    assert np.array_equal(coverage(blender, still, samples=16), coverage(blender, glowing_square, samples=16))


@pytest.mark.parametrize("z", [6, 60])
def test_nothing_is_drawn_outside_the_picture_region(blender, make_scene, needles, speedplus, monkeypatch, z) -> None:
    """The whole frame, rendered in one piece, holds the bands' pixels and nothing else; the region is tight."""
    camera = smaller(magnified(speedplus, z), 2)
    scene = make_scene(*needles, camera=camera, q=(0.5, -0.3, 0.7, 0.2), t=(0.2, 0.1, z))
    scene = moving(scene, along=(1.0, 0.5, 0.5), turn=(0.2, 0.3, 0.4), readout=0.3)
    in_bands, region = coverage(blender, scene, samples=64), scene.picture_region
    monkeypatch.setattr(type(scene), "picture_region", property(lambda self: self.camera.frame))
    monkeypatch.setattr(
        "spin_usd.renderers.blender.renderer.picture_bands", lambda scene, samples: [scene.camera.frame]
    )
    whole = coverage(blender, scene, samples=64)
    assert np.array_equal(whole, in_bands)
    global_shutter = replace(scene, shutter=replace(scene.shutter, readout=0.0))
    rows, columns = np.nonzero(coverage(blender, global_shutter, samples=256))
    found = np.array([columns.min(), rows.min(), -columns.max() - 1, -rows.max() - 1])
    slack = found - (region.x0, region.y0, -region.x1, -region.y1)
    assert slack.min() >= 0
    assert slack.max() <= 6  # padding, and what few samples miss at the end of the exposure


@pytest.mark.parametrize(("count", "readout"), [(2, 0), (4, 0), (9, -0.1), (9, 1.1)])
def test_other_shutters_are_refused(make_scene, square, count, readout) -> None:
    scene = make_scene(*square)
    with pytest.raises(GeometryError):
        in_motion(scene, (scene.T_cam_body,) * count, readout=readout)


def test_a_pose_that_is_not_the_middles_is_refused(make_scene, square) -> None:
    scene = moving(make_scene(*square), along=(1, 0, 0))
    with pytest.raises(GeometryError, match="middle"):
        with_first(scene, T_cam_body=scene.poses[0])
