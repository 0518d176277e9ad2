"""The lens and its inverse, against OpenCV and against the roots of its own polynomial."""

import cv2
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from spin_usd.errors import GeometryError
from spin_usd.geometry import lens
from tests.cases.scenes import BARREL, FOLDING, PINCUSHION, SPEEDPLUS

ROUNDING = 1e-14
NEAR_FOLD = 0.98  # of the invertible radius: nearer, the inverse is ill-conditioned
ROOT = 1e-9  # relative: of a polynomial's roots, found in two ways
SCALES = [1e-4, 1e-2, 1.0, 10.0]  # of normalised coordinates: from a focal length of metres to one of a millimetre
NEXT_TO_THE_FOLD = 1 - 1e-4  # of the invertible radius


def thousandths(most):
    return st.integers(round(-1000 * most), round(1000 * most)).map(lambda i: i / 1000)


coefficients = st.tuples(*[thousandths(most) for most in (0.6, 0.6, 0.02, 0.02, 0.4)])
radial_coefficients = st.tuples(*[thousandths(most) for most in (0.6, 0.6, 0.4)])


def disc(radius, count=200):
    """Points spread evenly over the disc."""
    i = np.arange(count) + 0.5
    angle = i * np.pi * (1 + 5**0.5)
    return radius * np.sqrt(i / count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)


@given(coefficients)
def test_distort_is_opencvs(k) -> None:
    xy = disc(1.5)
    rays = np.concatenate([xy, np.ones((len(xy), 1))], 1)
    theirs = cv2.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), np.eye(3), np.array(k))[0][:, 0]
    np.testing.assert_allclose(lens.distort(xy, k), theirs, rtol=ROUNDING, atol=ROUNDING)


@given(coefficients)
def test_jacobian_is_the_slope(k) -> None:
    xy, step = disc(1.2, 50), 1e-6
    for axis in (0, 1):
        aside = step * np.eye(2)[axis]
        slope = (lens.distort(xy + aside, k) - lens.distort(xy - aside, k)) / (2 * step)
        np.testing.assert_allclose(lens.distortion_jacobian(xy, k)[..., axis], slope, rtol=0, atol=1e-8)


@settings(max_examples=80)
@given(coefficients)
def test_undistort_is_the_inverse(k) -> None:
    """On the whole disc where there is one, however strong the lens."""
    xy = disc(NEAR_FOLD * min(lens.invertible_radius(k), 3))
    back = lens.undistort(lens.distort(xy, k), k)
    # Rounding of the distorted point, magnified where the lens is flat.
    least = np.linalg.svd(lens.distortion_jacobian(xy, k), compute_uv=False)[:, 1]
    assert (np.abs(back - xy).max(1) <= ROUNDING * 30 / least).all()


@pytest.mark.parametrize("camera", [SPEEDPLUS, BARREL, PINCUSHION])
def test_undistort_is_opencvs(camera) -> None:
    xy = disc(0.35)
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-16)
    theirs = cv2.undistortPoints(xy[:, None], np.eye(3), np.array(camera.distortion), criteria=stop)[:, 0]
    np.testing.assert_allclose(lens.undistort(xy, camera.distortion), theirs, rtol=0, atol=1e-12)


def test_a_lens_without_distortion_changes_nothing() -> None:
    xy = disc(3)
    np.testing.assert_array_equal(lens.undistort(xy, np.zeros(5)), xy)
    np.testing.assert_array_equal(lens.distort(xy, np.zeros(5)), xy)


@settings(max_examples=80)
@given(radial_coefficients)
def test_invertible_radius_is_the_fold(k) -> None:
    """Without tangential terms the map folds at the least radius where r (1 + k1 r2 + k2 r4 + k3 r6) has no slope."""
    k1, k2, k3 = k
    roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1])  # in r squared
    real = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real
    fold = np.sqrt(real.min()) if len(real) else np.inf
    assume(len(real) == len(set(np.round(real, 4))))  # a double root touches zero without folding
    found = lens.invertible_radius((k1, k2, 0, 0, k3))
    assert found == pytest.approx(fold, rel=ROOT)


def in_unit(k, unit):
    """The same lens where normalised coordinates are `unit` times as large."""
    return tuple(float(c * unit**power) for c, power in zip(k, (-2, -4, -1, -1, -6), strict=True))


@settings(max_examples=40)
@given(coefficients)
def test_the_fold_scales_with_the_focal_length(k) -> None:
    radius = lens.invertible_radius(k)
    for unit in SCALES:
        assert lens.invertible_radius(in_unit(k, unit)) == pytest.approx(unit * radius, rel=ROOT)


@settings(max_examples=40)
@given(coefficients, st.sampled_from(SCALES), st.sampled_from([1.0, 5.0]))
def test_next_to_the_fold_the_inverse_is_found(k, unit, strength) -> None:
    """At any focal length, however strong the lens: the point found is distorted to the one that was asked for."""
    strong = in_unit(tuple(strength * c for c in k), unit)
    xy = disc(NEXT_TO_THE_FOLD * min(lens.invertible_radius(strong), 3 * unit))
    least = np.linalg.svd(lens.distortion_jacobian(xy, strong), compute_uv=False)[:, 1]
    wanted = lens.distort(xy[least > 0], strong)  # between the directions that are looked along it may fold before
    found, there = lens.inverse(wanted, strong)
    assert there.all()
    assert np.abs(lens.distort(found, strong) - wanted).max() <= 10 * ROUNDING * np.abs(wanted).max()


def test_a_strong_lens_of_a_long_focal_length_folds() -> None:
    """A fold far within a thousandth of the focal length, which a search in steps of a thousandth would step over."""
    k = (-1e7, 0, 0, 0, 0)
    fold = np.sqrt(1 / 3e7)
    assert lens.invertible_radius(k) == pytest.approx(fold, rel=ROOT)
    beyond = 1.01 * lens.distort([fold, 0], k)
    assert not lens.inverse(beyond, k)[1]


@pytest.mark.parametrize("camera", [SPEEDPLUS, BARREL, FOLDING])
def test_a_point_without_inverse_is_refused(camera) -> None:
    """Just beyond the largest distorted radius that the lens's own branch reaches."""
    limit = lens.invertible_radius(camera.distortion)
    assert np.isfinite(limit)
    edge = lens.distort(np.array([limit, 0.0]), camera.distortion)
    with pytest.raises(GeometryError, match="cannot be inverted at normalised radius"):
        lens.undistort(edge * 1.01, camera.distortion)


def test_nan_is_refused() -> None:
    with pytest.raises(GeometryError):
        lens.undistort([np.nan, 0.1], BARREL.distortion)
