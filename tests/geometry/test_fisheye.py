"""The fisheye lens and its inverse, against OpenCV's module fisheye."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spin_usd.errors import GeometryError
from spin_usd.geometry import fisheye, lens
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye

ROUNDING = 4e-15  # of distances of one or two focal lengths
NEAR = 1 - 1e-6  # of the angle that the lens sees
coefficients = st.tuples(
    *[st.integers(-1000 * most // 100, 1000 * most // 100).map(lambda i: i / 1000) for most in (30, 10, 5, 2)]
).map(lambda k: Fisheye(*k))


def directions(k, count=300):
    """Unit vectors (N, 3), evenly up to what the lens sees."""
    i = np.arange(count)
    angle, turn = NEAR * fisheye.seen_angle(k) * (i + 0.5) / count, i * np.pi * (1 + 5**0.5)
    return np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], -1)


@given(coefficients)
def test_distort_is_opencvs(k) -> None:
    rays = directions(k)
    theirs = cv2.fisheye.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), np.eye(3), np.array(k))[0][:, 0]
    np.testing.assert_allclose(lens.distort(rays[:, :2] / rays[:, 2:], k), theirs, rtol=0, atol=ROUNDING)


@settings(max_examples=60)
@given(coefficients)
def test_the_inverse_is_exact_up_to_the_edge(k) -> None:
    rays = directions(k)
    distorted = lens.distort(rays[:, :2] / rays[:, 2:], k)
    found, there = lens.inverse(distorted, k)
    assert there.all()
    np.testing.assert_allclose(lens.distort(found, k), distorted, rtol=0, atol=ROUNDING)


@given(coefficients)
def test_jacobian_is_the_slope(k) -> None:
    rays, step = directions(k), 1e-6
    xy = rays[:, :2] / rays[:, 2:]
    xy = xy[np.hypot(*xy.T) < 5]
    for axis in (0, 1):
        aside = step * np.eye(2)[axis]
        slope = (lens.distort(xy + aside, k) - lens.distort(xy - aside, k)) / (2 * step)
        np.testing.assert_allclose(lens.distortion_jacobian(xy, k)[..., axis], slope, rtol=0, atol=1e-8)


def test_a_lens_that_folds_is_refused_and_one_that_sees_half_a_turn_is_blind_beyond() -> None:
    numbers = {"width": 640, "height": 640, "cx": 320.0, "cy": 320.0}
    whole = Camera(**numbers, fx=640 / np.pi, fy=640 / np.pi, distortion=Fisheye(0.0, 0.0, 0.0, 0.0))
    whole.check_invertible()
    blind = whole.blind(whole.frame)
    far = np.hypot(*np.moveaxis(np.indices((640, 640)) + 0.5 - 320, 0, -1).T)
    np.testing.assert_array_equal(blind, far >= 320)
    with pytest.raises(GeometryError, match="cannot be inverted at pixel"):
        Camera(**numbers, fx=200.0, fy=200.0, distortion=Fisheye(-0.3, 0.0, 0.0, 0.0)).check_invertible()


def test_four_numbers_alone_are_no_fisheye() -> None:
    with pytest.raises(GeometryError, match="not five"):
        Camera(width=10, height=10, fx=5.0, fy=5.0, cx=5.0, cy=5.0, distortion=(0.1, 0.0, 0.0, 0.0))
