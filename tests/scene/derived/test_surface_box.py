"""The box of a target's surface: of targets in the frame, partly outside it, and around the camera."""

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface_box import BEYOND_PX, cut_off, surface_box
from tests.cases.instanced import expanded, placed
from tests.cases.scenes import BARREL, FOLDING, GREY, SMALL, box, pose, scene, soup, target

PLAIN = Camera(width=64, height=48, fx=70, fy=71, cx=31, cy=25)
SAMPLED_PX = 0.2  # samples on a triangle, 1/400 of it apart
CASTER = EmbreeCaster()


def box_of(s):
    return surface_box(s, lambda xy: CASTER.cast(s, xy) >= 0)


def sampled(s, steps=400):
    """The box of points spread over every triangle, of those that the lens sees."""
    u, v = np.meshgrid(np.linspace(0, 1, steps), np.linspace(0, 1, steps))
    weights = np.stack([u, v, 1 - u - v], -1)[u + v <= 1]
    corners = s.T_cam_body.points(s.target.mesh.points)[s.target.mesh.faces]
    pixels = s.camera.project((weights @ corners).reshape(-1, 3))
    pixels = pixels[np.isfinite(pixels).all(1)]
    return np.stack([pixels.min(0), pixels.max(0)]) if len(pixels) else None


@pytest.mark.parametrize("camera", [PLAIN, SMALL, BARREL, FOLDING], ids=["plain", "small", "barrel", "folding"])
@pytest.mark.parametrize("t", [(0, 0, 5), (1.2, -0.8, 4), (-3, 1, 5)], ids=["inside", "cut off", "outside"])
def test_it_is_that_of_points_spread_over_the_surface(camera, t) -> None:
    points, faces, parts = soup(3, count=10)
    s = scene(target(points, faces, parts=parts), camera=camera, T_cam_body=pose((0.3, 0.5, 0.7, -0.2), t))
    found, expected = box_of(s), sampled(s)
    np.testing.assert_allclose(found, expected, atol=SAMPLED_PX)
    assert (found[0] <= expected[0] + 1e-6).all()
    assert (found[1] >= expected[1] - 1e-6).all()


def test_a_target_around_the_camera_reaches_as_far_as_a_box_may() -> None:
    s = scene(target(*box((-1, -1, -1), (1, 1, 1))), camera=PLAIN, T_cam_body=pose(t=(0, 0, 0.1)))
    np.testing.assert_array_equal(box_of(s), [[-BEYOND_PX] * 2, [PLAIN.width + BEYOND_PX, PLAIN.height + BEYOND_PX]])
    assert cut_off(s, box_of(s))


def test_a_lens_that_folds_sees_no_further_than_its_rim() -> None:
    wall = target(*box((-50, -50, 0), (50, 50, 1)))
    s = scene(wall, camera=FOLDING, T_cam_body=pose(t=(0, 0, 2)))
    found, part = (
        box_of(s),
        target(*box((-2, -2, 0), (2, 2, 1))),
    )  # the rest is beyond the rim, and samples would be sparse
    expected = sampled(scene(part, camera=FOLDING, T_cam_body=pose(t=(0, 0, 2))))
    np.testing.assert_allclose(found, expected, atol=SAMPLED_PX)
    assert cut_off(s, found)


def test_a_target_partly_behind_the_camera_has_the_box_of_what_is_before_it() -> None:
    bar = target(*box((-0.1, -0.1, -5), (0.1, 0.1, 5)))
    s = scene(bar, camera=PLAIN, T_cam_body=pose(t=(0.5, 0.05, 2)))
    x0, y0, x1, y1 = box_of(s).ravel()
    far = PLAIN.project([[0.4, -0.05, 7], [0.4, 0.15, 7]])
    assert x0 == pytest.approx(far[:, 0].min())
    assert x1 == PLAIN.width + BEYOND_PX
    assert (y0, y1) == (-BEYOND_PX, PLAIN.height + BEYOND_PX)


def test_nothing_is_seen_of_a_target_behind_the_camera() -> None:
    s = scene(target(*box()), camera=SMALL, T_cam_body=pose(t=(0, 0, -4)))
    assert box_of(s) is None
    assert cut_off(s, None)


def test_whether_a_target_is_cut_off() -> None:
    whole, cut = (scene(target(*box()), camera=SMALL, T_cam_body=pose(t=(x, 0, 5))) for x in (0, 2.3))
    assert not cut_off(whole, box_of(whole))
    assert cut_off(cut, box_of(cut))


@pytest.mark.parametrize("camera", [PLAIN, SMALL], ids=["plain", "distorted"])
def test_instances_count_in_all_their_places(camera) -> None:
    s = scene(placed(materials=(GREY, GREY)), camera=camera)
    np.testing.assert_allclose(box_of(s), box_of(expanded(s)), atol=1e-9)
