"""Reaches of blur hold every point that lens and motion can smear, and little more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.geometry.blur import arc_height, circle_of_confusion, magnification, offset_blur_radius, rotation_angle
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import turn_between
from spin_usd.geometry.transform import Transform
from tests.cases.scenes import BARREL, PINCUSHION, SPEEDPLUS, unit_quaternions

ROUNDING = 1e-12

depths = st.floats(0.5, 1e6)


@given(depths, depths, st.floats(0, 2 * np.pi), st.floats(1e-4, 0.1))
def test_circle_of_confusion_is_where_rays_from_the_rim_meet_the_image(depth, focus, turn, radius) -> None:
    """Trace a ray from the aperture's rim through the point to the plane of focus; the chief ray through the place
    that it meets there is the pixel's."""
    point, rim = np.array([0.3 * depth, -0.2 * depth, depth]), radius * np.array([np.cos(turn), np.sin(turn), 0])
    met = rim + (point - rim) * focus / depth
    seen = np.linalg.norm(met[:2] / focus - point[:2] / depth)
    wanted = circle_of_confusion(depth, radius=radius, focus=focus)
    assert np.isclose(seen, wanted, rtol=1e-9, atol=ROUNDING)


def test_no_circle_in_focus_and_a_finite_one_at_infinity() -> None:
    assert circle_of_confusion(7.0, radius=0.1, focus=7.0) == 0
    assert np.isclose(circle_of_confusion(1e30, radius=0.1, focus=4.0), 0.1 / 4)


@given(unit_quaternions(), unit_quaternions(), st.floats(0, 1))
def test_arc_height_bounds_the_way_between_two_poses(q, r, share) -> None:
    a, b = (Transform.from_quaternion(to="cam", of="body", q=x, t=(0, 0, 9)) for x in (q, r))
    corner = np.array([1.2, -0.5, 2.0])
    turned = turn_between(a.rotation, b.rotation, share) @ corner
    chord = (1 - share) * a.rotation @ corner + share * b.rotation @ corner
    assert np.linalg.norm(turned - chord) <= arc_height(np.linalg.norm(corner), (a, b)) + ROUNDING


@given(unit_quaternions(), st.floats(0, np.pi))
def test_angle_is_that_of_the_turn_between(q, angle) -> None:
    a = Transform.from_quaternion(to="cam", of="body", q=q, t=(0, 0, 0))
    b = a @ Transform.from_quaternion(to="body", of="b", q=(np.cos(angle / 2), np.sin(angle / 2), 0, 0), t=(0, 0, 0))
    assert np.isclose(rotation_angle(a, b), angle, atol=1e-7)  # an arc sine near its end


@given(st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.1, 5)), st.floats(0, 0.2), st.integers(0, 2**32 - 1))
def test_a_point_moved_by_an_offset_stays_within_its_reach(point, offset, seed) -> None:
    where = np.array([point])
    aside = np.random.default_rng(seed).normal(size=(50, 3))
    moved = where + offset * aside / np.linalg.norm(aside, axis=1, keepdims=True)
    radius = offset_blur_radius(where, offset)[0]
    seen = np.linalg.norm(moved[:, :2] / moved[:, 2:] - where[:, :2] / where[:, 2:], axis=1)
    assert radius == np.inf or seen.max() <= radius + ROUNDING
    assert radius == np.inf or offset < point[2]


@given(st.sampled_from([SPEEDPLUS, BARREL, PINCUSHION]), st.integers(0, 2**32 - 1))
def test_no_step_in_the_frame_is_magnified_more(camera, seed) -> None:
    rng = np.random.default_rng(seed)
    uv = rng.uniform((0, 0), (camera.width, camera.height), (2, 200, 2))
    steps = np.linalg.norm(np.subtract(*uv), axis=1) / np.linalg.norm(np.subtract(*camera.normalised(uv)), axis=1)
    assert steps.max() <= magnification(camera) * (1 + 1e-4)  # between the points of the grid


def test_without_distortion_a_step_is_the_longer_focal_length() -> None:
    assert magnification(Camera(width=64, height=48, fx=70, fy=71, cx=31, cy=25)) == pytest.approx(71)
