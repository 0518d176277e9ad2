"""A fisheye up to a right angle from its axis: labels, boxes and Blender's rays, against OpenCV's module fisheye."""

import cv2
import numpy as np
import pytest

from spin_usd.geometry.bounds import region_of_interest
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.geometry.transform import Transform
from spin_usd.renderers.camera_shader import View, lens_inverse
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.derived.surface_box import surface_box
from tests.cases.scenes import box, scene, target

EXACT_PX = 1e-7  # of points on a pixel's own ray; a body of 1 m whose depth is 0.05 m magnifies rounding
BOX_PX = 1e-3  # of 2000 points along each edge
CAMERA = Camera(
    width=240, height=200, fx=64.0, fy=65.0, cx=118.5, cy=101.0, distortion=Fisheye(0.012, -0.012, 0.02, -0.004)
)
ANGLES = (0, 40, 70, 80, 88)  # degrees from the axis, of the middle of a box
TURNED = np.array([0.8, 0.1, 0.5, 0.3])


def seen(angle, place=0.7):
    """A scene whose box is seen so many degrees from the axis, 3 m away."""
    way = np.array([np.sin(angle) * np.cos(place), np.sin(angle) * np.sin(place), np.cos(angle)])
    pose = Transform.from_quaternion(to="cam", of="body", q=TURNED / np.linalg.norm(TURNED), t=3 * way)
    return scene(target(*box()), camera=CAMERA, T_cam_body=pose)


def opencv(camera, points):
    return cv2.fisheye.projectPoints(
        points[:, None], np.zeros(3), np.zeros(3), camera.matrix, np.array(camera.distortion)
    )[0][:, 0]


@pytest.mark.parametrize("degrees", ANGLES)
def test_labels_project_to_their_own_pixels(degrees) -> None:
    shown = seen(np.radians(degrees))
    surface = visible_surface(shown, EmbreeCaster().visibility(shown))
    assert len(surface.rows) > 50
    points = shown.T_cam_body.points(surface.body)
    wanted = np.stack([surface.columns, surface.rows], -1) + 0.5
    np.testing.assert_allclose(opencv(CAMERA, points), wanted, rtol=0, atol=EXACT_PX)


@pytest.mark.parametrize("degrees", ANGLES)
def test_the_region_holds_all_that_is_seen_and_nothing_beyond_a_right_angle_is(degrees) -> None:
    shown = seen(np.radians(degrees))
    xy = CAMERA.centres(CAMERA.frame).reshape(-1, 2)
    blind = CAMERA.blind(CAMERA.frame)
    met = EmbreeCaster().meets(shown, xy).reshape(CAMERA.frame.shape) & ~np.asarray(blind)
    region = region_of_interest(CAMERA, shown.T_cam_body.points(shown.target.mesh.hull))
    outside = met.copy()
    outside[region.slices] = False
    assert met.any()
    assert not outside.any()
    visible = EmbreeCaster().visibility(shown)
    np.testing.assert_array_equal(visible.face >= 0, met[visible.region.slices])


@pytest.mark.parametrize("degrees", ANGLES[:4])
def test_the_box_is_that_of_opencvs_edges(degrees) -> None:
    shown = seen(np.radians(degrees))
    caster = EmbreeCaster()
    found = surface_box(shown, lambda xy: caster.meets(shown, xy))
    points, edges = shown.T_cam_body.points(shown.target.mesh.points), shown.target.mesh.edges
    share = np.linspace(0, 1, 2001)[:, None, None]
    along = (points[edges[:, 0]] * (1 - share) + points[edges[:, 1]] * share).reshape(-1, 3)
    pixels = opencv(CAMERA, along[along[:, 2] > 0])
    np.testing.assert_allclose(found, [pixels.min(0), pixels.max(0)], rtol=0, atol=BOX_PX)


def test_the_shaders_inverse_reaches_the_right_angle() -> None:
    inverse = lens_inverse(CAMERA)
    assert inverse.steps <= 3
    text = View(camera=CAMERA, centre=np.array([0, 0, 5.0]), radius=1.0).shader
    assert "throughput = 0.0" in text


@pytest.mark.slow
@pytest.mark.parametrize("degrees", ANGLES)
def test_blender_sees_the_same_faces(blender, degrees) -> None:
    shown = seen(np.radians(degrees))
    ours = EmbreeCaster().visibility(shown)
    theirs = blender.visibility(shown)
    assert ours.region == theirs.region
    differ = ours.face != theirs.face
    assert differ.mean() < 2e-3  # pixels whose centre lies on an edge
