"""Vignetting against OpenCV's own inverse of the lens."""

import cv2
import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.scene.derived.vignetting import least_gain
from spin_usd.scene.sensor import Optics
from spin_usd.sensor.develop import vignetting_gain
from tests.cases import scenes


@pytest.mark.parametrize("camera", [scenes.BARREL, scenes.PINCUSHION])
def test_natural_vignetting_is_of_the_rays_true_angle(camera) -> None:
    gain = vignetting_gain(camera, Optics(cos_fourth=True))
    pixels = np.array([[0.5, 0.5], [300.5, 17.5], [158.5, 121.5], [12.5, 200.5]])
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    xy = cv2.undistortPoints(pixels[:, None], camera.matrix, np.array(camera.distortion), criteria=stop)[:, 0]
    axis = np.array([0, 0, 1])
    rays = np.concatenate([xy, np.ones((4, 1))], 1)
    cosine = rays @ axis / np.linalg.norm(rays, axis=1)
    columns, rows = pixels.astype(int).T
    np.testing.assert_allclose(gain[rows, columns], cosine**4, rtol=1e-5)


def test_the_polynomial_counts_half_diagonals() -> None:
    camera = Camera(width=301, height=401, fx=500, fy=500, cx=150.5, cy=200.5)
    gain = vignetting_gain(camera, Optics(vignetting=(-0.5, 0.25, -0.125)))
    assert gain[200, 150] == 1
    half_way = (250 - np.hypot(0.5, 0.5)) / (np.hypot(301, 401) / 2)
    radius = np.hypot(150, 200) / (np.hypot(301, 401) / 2)
    assert abs(radius - half_way) < 0.01
    assert gain[0, 0] == pytest.approx(1 - 0.5 * radius**2 + 0.25 * radius**4 - 0.125 * radius**6, rel=1e-6)


def test_both_multiply_and_none_is_none() -> None:
    camera = scenes.SMALL
    both = vignetting_gain(camera, Optics(cos_fourth=True, vignetting=(-0.3, 0, 0)))
    cosine = vignetting_gain(camera, Optics(cos_fourth=True))
    polynomial = vignetting_gain(camera, Optics(vignetting=(-0.3, 0, 0)))
    assert cosine is not None
    assert polynomial is not None
    np.testing.assert_allclose(both, cosine * polynomial, rtol=1e-6)
    assert vignetting_gain(camera, Optics()) is None


def test_the_least_gain_is_that_of_the_whole_frame() -> None:
    camera = Camera(width=400, height=300, fx=500, fy=500, cx=180, cy=160)
    coefficients = (-1.5, 1.0, 0.1)  # falls, then rises again
    gain = vignetting_gain(camera, Optics(vignetting=coefficients))
    assert least_gain(camera, coefficients) == pytest.approx(gain.min(), abs=1e-3)
