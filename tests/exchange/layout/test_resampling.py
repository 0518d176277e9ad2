"""Pictures without distortion are those that OpenCV makes, and exact where the answer is known."""

import cv2
import numpy as np
import pytest

from spin_usd.exchange.layout.rectified_picture import resampling
from spin_usd.geometry.camera import Camera

BARREL = Camera(width=96, height=60, fx=149.4, fy=149.4, cx=48, cy=30, distortion=(-0.22, 0.51, -7e-4, -2e-4, -0.13))
PINCUSHION = Camera(width=96, height=60, fx=60, fy=61, cx=47, cy=31, distortion=(0.3, 0.1, 0, 0, 0))
OPENCV_STEP = 1 / 32  # pixels: OpenCV rounds places to so much before it interpolates


def uv_grid(camera):
    return np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), -1) + 0.5


def test_no_distortion_changes_nothing() -> None:
    camera = Camera(width=7, height=5, fx=9, fy=8, cx=3, cy=2)
    noise = np.random.default_rng(0).integers(0, 2**16, (5, 7, 3), np.uint16)
    np.testing.assert_array_equal(resampling(camera).interpolated(noise), noise)
    np.testing.assert_array_equal(resampling(camera).nearest(noise), noise)


@pytest.mark.parametrize("camera", [BARREL, PINCUSHION])
def test_an_image_that_says_where_it_is_says_so_after(camera) -> None:
    """An image of its own pixel coordinates: interpolated it is where each new pixel's ray falls."""
    found = resampling(camera)
    old = (uv_grid(camera) * 100).astype(np.uint16)  # whole numbers, so exact
    rays = np.concatenate(
        [(uv_grid(camera) - (camera.cx, camera.cy)) / (camera.fx, camera.fy), np.ones((60, 96, 1))], -1
    )
    wanted = camera.project(rays)
    inner = ((wanted >= 0.5) & (wanted <= np.array([96, 60]) - 0.5)).all(-1)
    np.testing.assert_allclose(found.interpolated(old)[inner] / 100, wanted[inner], atol=0.501 / 100)  # it is rounded
    np.testing.assert_array_equal((found.nearest(old)[inner] / 100).astype(int), wanted[inner].astype(int))


@pytest.mark.parametrize("shape", [(60, 96), (60, 96, 3)])
def test_images_are_those_of_opencv(shape) -> None:
    smooth = cv2.GaussianBlur(np.random.default_rng(1).integers(0, 256, shape).astype(np.uint8), (0, 0), 2)
    K = BARREL.matrix - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])  # its first pixel has its centre at (0, 0)
    wanted = cv2.undistort(smooth, K, np.array(BARREL.distortion))
    found = resampling(BARREL).interpolated(smooth).astype(int)
    steepest = max(np.abs(np.diff(smooth.astype(int), axis=axis)).max() for axis in (0, 1))
    inner = np.s_[1:-1, 1:-1]  # at the rim OpenCV mixes in black
    assert np.abs(found[inner] - wanted[inner]).max() <= 1 + 2 * OPENCV_STEP * steepest


def test_what_the_lens_did_not_show_is_black() -> None:
    """A lens whose image reaches further than the frame leaves the pinhole's corners empty."""
    found = resampling(PINCUSHION)
    assert not found.covered[[0, 0, -1, -1], [0, -1, 0, -1]].any()
    assert found.covered[30, 47]
    white = np.full((60, 96), 255, np.uint8)
    np.testing.assert_array_equal(found.interpolated(white), np.where(found.covered, 255, 0))
    np.testing.assert_array_equal(found.nearest(white), np.where(found.covered, 255, 0))


def test_labels_hold_no_number_that_was_not_there() -> None:
    ids = np.random.default_rng(2).choice([0, 7, 300], (60, 96)).astype(np.uint16)
    assert set(np.unique(resampling(BARREL).nearest(ids))) <= {0, 7, 300}
