"""Scores by hand and against other formulas: angles as scipy has them, thresholds at their edges."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.scoring.pose_errors import ATTITUDE_THRESHOLD, POSITION_THRESHOLD, PoseErrors, angles_between, scores

IDENTITY = np.array([[1.0, 0, 0, 0]])


def turned(degrees):
    half = np.radians(degrees) / 2
    return np.array([[np.cos(half), np.sin(half), 0, 0]])


def errors_of(position, degrees, away=10.0):
    true_t = np.array([[0, 0, away]])
    return PoseErrors.of(q=turned(degrees), t=true_t + np.array([position, 0, 0]), true_q=IDENTITY, true_t=true_t)


def test_angles_are_those_of_scipy() -> None:
    one, other = (Rotation.random(200, random_state=seed) for seed in (1, 2))
    expected = (one.inv() * other).magnitude()
    found = angles_between(one.as_quat(scalar_first=True), -other.as_quat(scalar_first=True))
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_a_tiny_angle_keeps_its_digits() -> None:
    half = 0.5e-9
    found = angles_between(np.array([[np.cos(half), np.sin(half), 0, 0]]), IDENTITY)
    np.testing.assert_allclose(found, 1e-9, rtol=1e-12)


def test_a_perfect_prediction_scores_nothing() -> None:
    q, t = Rotation.random(50, random_state=3).as_quat(scalar_first=True), np.full((50, 3), 4.0)
    errors = PoseErrors.of(q=-q, t=t, true_q=q, true_t=t)
    assert all(not scores(errors, name).any() for name in ("speed", "speedplus", "speedplus_2021"))


@pytest.mark.parametrize(
    ("position", "degrees", "speed", "speedplus", "speedplus_2021"),
    [
        # by hand: 0.1 m of 10 m is 0.01, and 1 degree is 0.0174532925 radians
        (0.1, 1.0, 0.0274532925, 0.0274532925, 0.0274532925),
        (0.02, 1.0, 0.0194532925, 0.0174532925, 0.0194532925),  # 0.002 is below its threshold
        (0.1, 0.1, 0.0117453293, 0.01, 0.0117453293),
        (0.02, 0.1, 0.0037453293, 0.0, 0.0),
    ],
)
def test_scores_by_hand(position, degrees, speed, speedplus, speedplus_2021) -> None:
    errors = errors_of(position, degrees)
    found = [scores(errors, name).item() for name in ("speed", "speedplus", "speedplus_2021")]
    np.testing.assert_allclose(found, [speed, speedplus, speedplus_2021], atol=1e-10)


def test_thresholds_are_those_of_the_calibration() -> None:
    above, below = 1 + 1e-9, 1 - 1e-9
    degrees = np.degrees(ATTITUDE_THRESHOLD)
    assert scores(errors_of(10 * POSITION_THRESHOLD * below, degrees * below), "speedplus") == 0
    np.testing.assert_allclose(
        scores(errors_of(10 * POSITION_THRESHOLD * above, degrees * above), "speedplus"),
        2.173e-3 + np.radians(0.169),
        rtol=1e-6,
    )
