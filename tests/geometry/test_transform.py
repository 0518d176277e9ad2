"""Transforms: the axioms of a group, and frames that must touch."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import FrameError, GeometryError
from spin_usd.geometry.frames import T_CAM_USDCAM, T_USDCAM_CAM
from spin_usd.geometry.transform import Transform
from tests.cases.scenes import unit_quaternions

ROUNDING = 1e-14  # of the largest number involved
POINTS = np.array([[0, 0, 0], [1, -2, 3], [-0.5, 0.25, 8.0]])

vectors = st.tuples(*[st.floats(-100, 100)] * 3)


@st.composite
def transforms(draw, to, of):
    return Transform.from_quaternion(to=to, of=of, q=draw(unit_quaternions()), t=draw(vectors))


def assert_same(a, b) -> None:
    assert (a.to, a.of) == (b.to, b.of)
    np.testing.assert_allclose(a.matrix, b.matrix, rtol=0, atol=ROUNDING * 300)


@given(transforms("a", "b"), transforms("b", "c"), transforms("c", "d"))
def test_product_is_associative(ab, bc, cd) -> None:
    assert_same((ab @ bc) @ cd, ab @ (bc @ cd))


@given(transforms("a", "b"))
def test_inverse_cancels(ab) -> None:
    identity = Transform(to="a", of="a", rotation=np.eye(3), translation=np.zeros(3))
    assert_same(ab @ ab.inverse(), identity)
    assert_same(ab.inverse().inverse(), ab)


@given(transforms("a", "b"), transforms("b", "c"))
def test_product_moves_points_as_one_after_the_other(ab, bc) -> None:
    np.testing.assert_allclose((ab @ bc).points(POINTS), ab.points(bc.points(POINTS)), rtol=0, atol=ROUNDING * 300)


@given(transforms("a", "b"))
def test_points_are_those_of_the_matrix(ab) -> None:
    homogeneous = np.concatenate([POINTS, np.ones((3, 1))], 1) @ ab.matrix.T
    np.testing.assert_allclose(ab.points(POINTS), homogeneous[:, :3], rtol=0, atol=ROUNDING * 300)


@given(transforms("a", "b"))
def test_directions_keep_length_and_do_not_move(ab) -> None:
    turned = ab.directions(POINTS)
    np.testing.assert_allclose(turned, ab.points(POINTS) - ab.points(np.zeros(3)), rtol=0, atol=ROUNDING * 300)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(POINTS, axis=1), rtol=ROUNDING)


@given(transforms("a", "b"))
def test_frames_that_do_not_touch_are_refused(ab) -> None:
    with pytest.raises(FrameError, match="T_a_b @ T_a_b"):
        ab @ ab


@pytest.mark.parametrize("t", [[0, 0, np.nan], [np.inf, 0, 0], [0, 0]])
def test_bad_translations_are_refused(t) -> None:
    with pytest.raises(GeometryError, match="translation"):
        Transform.from_quaternion(to="a", of="b", q=[1, 0, 0, 0], t=t)


def test_usd_cameras_look_along_minus_z_with_y_up() -> None:
    np.testing.assert_array_equal(T_CAM_USDCAM.directions([[0, 0, -1], [0, 1, 0], [1, 0, 0]]), [[0, 0, 1], [0, -1, 0], [1, 0, 0]])  # fmt: skip  # noqa: E501
    np.testing.assert_array_equal((T_USDCAM_CAM @ T_CAM_USDCAM).matrix, np.eye(4))
