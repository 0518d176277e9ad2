"""Poses from keypoints: exact ones give the pose back through a strong lens, and wrong ones among them do no harm."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.scoring.keypoint_pose import pose_from_keypoints
from spin_usd.scoring.pose_errors import angles_between

CAMERA = Camera(
    width=1920, height=1200, fx=2988.6, fy=2988.3, cx=960.0, cy=600.0, distortion=(-0.22, 0.51, 6.6e-4, -2e-4, -0.13)
)
POINTS = np.random.default_rng(4).uniform(-0.5, 0.5, (11, 3))
T = np.array([0.2, -0.1, 6.0])


@pytest.mark.parametrize("seed", range(5))
def test_exact_keypoints_give_the_pose_back(seed) -> None:
    q = Rotation.random(random_state=seed).as_quat(scalar_first=True)
    pixels = CAMERA.project(POINTS @ matrix_from_quaternion(q).T + T)
    pixels[:2] += 300  # two were found in a wrong place
    found = pose_from_keypoints(POINTS, pixels, CAMERA)
    assert found is not None
    found_q, found_t = found
    assert angles_between(found_q[None], q[None]) < 1e-6
    np.testing.assert_allclose(found_t, T, atol=1e-6)


def test_too_few_points_or_all_in_one_place_give_none() -> None:
    pixels = CAMERA.project(POINTS + T)
    assert pose_from_keypoints(POINTS[:4], pixels[:4], CAMERA) is None
    assert pose_from_keypoints(np.zeros((8, 3)), np.full((8, 2), 600.0), CAMERA) is None
