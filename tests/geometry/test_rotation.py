"""Quaternions and matrices, against SciPy's Rotation."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from spin_usd.errors import GeometryError
from spin_usd.geometry.rotation import (
    FEW,
    matrix_from_quaternion,
    product,
    quaternion_from_matrix,
    turn_between,
    unit_quaternion,
)
from tests.cases.scenes import unit_quaternions

WIDE = st.floats(-1e100, 1e100)
ROUNDING = 4e-16 * 4  # a few units in the last place of numbers up to one


def scipy(q):
    return Rotation.from_quat(q, scalar_first=True)


@given(unit_quaternions())
def test_matrix_is_scipys(q) -> None:
    np.testing.assert_allclose(matrix_from_quaternion(q), scipy(q).as_matrix(), rtol=0, atol=ROUNDING)


@given(arrays(np.float64, (3, 3), elements=WIDE), arrays(np.float64, (FEW, 3), elements=WIDE))
def test_a_product_with_one_vector_or_three_has_the_bits_of_one_with_many(matrix, vectors) -> None:
    many = product(matrix, vectors)
    for count in (1, 3):
        few = [product(matrix, vectors[i : i + count]) for i in range(0, FEW, count)]
        assert np.concatenate(few).tobytes() == many.tobytes()
    assert product(matrix, vectors[0]).tobytes() == many[0].tobytes()


@given(unit_quaternions(), unit_quaternions(), st.floats(-0.1, 1.1))
def test_turn_between_is_scipys_rotation_vector_shortened(q, r, share) -> None:
    way = scipy(q).inv() * scipy(r)
    assume(way.magnitude() < np.pi - 1e-6)  # half a turn has two ways
    wanted = scipy(q) * Rotation.from_rotvec(share * way.as_rotvec())
    found = turn_between(scipy(q).as_matrix(), scipy(r).as_matrix(), share)
    np.testing.assert_allclose(found, wanted.as_matrix(), rtol=0, atol=1e-9)


@given(unit_quaternions())
def test_quaternion_comes_back(q) -> None:
    """Up to its sign, at every angle, half turns included."""
    back = quaternion_from_matrix(matrix_from_quaternion(q))
    assert back[0] >= 0
    assert min(np.abs(back - q).max(), np.abs(back + q).max()) <= ROUNDING


@given(unit_quaternions())
def test_labels_of_six_decimals_are_accepted(q) -> None:
    """SPEED+'s synthetic labels are rounded to six decimals, which moves the norm by up to 1e-6."""
    np.testing.assert_allclose(unit_quaternion(np.round(q, 6)), q, rtol=0, atol=2e-6)


@pytest.mark.parametrize("q", [[1, 1, 0, 0], [1.00002, 0, 0, 0], [0.99998, 0, 0, 0], [1e20, 0, 0, 0], [1e-20, 0, 0, 0]])
def test_other_norms_are_refused(q) -> None:
    with pytest.raises(GeometryError, match="norm"):
        unit_quaternion(q)


@pytest.mark.parametrize("q", [[0, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 0], [1, 0, 0], [[1, 0, 0, 0]]])
def test_what_is_no_quaternion_is_refused(q) -> None:
    with pytest.raises(GeometryError):
        unit_quaternion(q)


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([1, 1, -1]),
        np.eye(3) * (1 + 1e-8),
        np.eye(3) + 1e-8 * np.eye(3, k=1),
        np.zeros((3, 3)),
        np.full((3, 3), np.nan),
        np.eye(4),
    ],
)
def test_what_is_no_rotation_is_refused(matrix) -> None:
    with pytest.raises(GeometryError):
        quaternion_from_matrix(matrix)
