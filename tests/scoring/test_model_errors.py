"""ADD, ADD-S, MSSD and MSPD against every pair of points, and BOP's recalls at their thresholds."""

import numpy as np
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from spin_usd.geometry.camera import Camera
from spin_usd.scene.shape import hull_points
from spin_usd.scoring.model_errors import found_share, model_errors, mspd_recall, mssd_recall

CAMERA = Camera(width=640, height=480, fx=700.0, fy=710.0, cx=320.0, cy=240.0)
POINTS = np.random.default_rng(0).uniform(-1, 1, (300, 3))
HULL = hull_points(POINTS)


def pose(rotation, t):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.as_matrix(), t
    return matrix


TRUE = pose(Rotation.random(random_state=1), (0.1, -0.2, 8.0))
PREDICTED = pose(Rotation.random(random_state=2), (0.0, 0.3, 8.5))


def test_errors_are_those_of_every_pair_of_points() -> None:
    found = model_errors(POINTS, HULL, PREDICTED[None], TRUE[None], CAMERA)
    here, there = (POINTS @ matrix[:3, :3].T + matrix[:3, 3] for matrix in (TRUE, PREDICTED))
    apart = np.linalg.norm(here - there, axis=1)
    pixels = [points[:, :2] / points[:, 2:] * (700, 710) for points in (here, there)]
    np.testing.assert_allclose(found.add, apart.mean(), rtol=1e-12)
    np.testing.assert_allclose(found.add_s, cdist(here, there).min(1).mean(), rtol=1e-12)
    np.testing.assert_allclose(found.mssd, apart.max(), rtol=1e-12)
    np.testing.assert_allclose(found.mspd, np.linalg.norm(pixels[0] - pixels[1], axis=1).max(), rtol=1e-12)


def test_a_target_moved_aside_is_off_by_as_much() -> None:
    moved = TRUE.copy()
    moved[:3, 3] += (0.25, 0, 0)
    found = model_errors(POINTS, HULL, moved[None], TRUE[None], CAMERA)
    np.testing.assert_allclose([found.add, found.mssd], 0.25, rtol=1e-12)
    assert found.add_s < 0.25


def test_a_prediction_behind_the_camera_is_infinitely_far_in_the_image() -> None:
    behind = pose(Rotation.identity(), (0, 0, -5.0))
    assert np.isinf(model_errors(POINTS, HULL, behind[None], TRUE[None], CAMERA).mspd)


def test_recalls_count_the_thresholds_that_hold() -> None:
    assert found_share(np.array([0.09, 0.11]), 1.0) == 0.5
    assert mssd_recall(np.array([0.26]), 1.0) == 0.5  # below 0.30, 0.35 ... 0.50
    assert mspd_recall(np.array([52.0]), 1280) == 0.5  # 10, 20 ... 100 pixels there, below 60 ... 100
