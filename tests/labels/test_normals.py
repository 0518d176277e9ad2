"""Normals stand across the surface that the dense pose describes, and face the camera; `check` finds what does not."""

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.labels.normals import faults_body, faults_cam
from tests.cases.labelled import labels_of, picture_of
from tests.cases.scenes import BARREL, box, pose, scene, soup, target

FLOAT32 = 1e-6  # of each component
TURNED = pose((0.5, -0.3, 0.7, 0.2), (0.3, -0.2, 3))
BENT = 2e-3  # of a normal from differences: float32 of a metre over the millimetres between two pixels


@pytest.fixture(scope="module")
def labelled():
    points, faces, parts = soup(11, count=30)
    made = scene(target(points, faces, parts=parts), camera=BARREL, T_cam_body=TURNED)
    return made, labels_of(made)


def test_normals_are_those_of_finite_differences_of_the_dense_pose(labelled) -> None:
    """Where three pixels beside each other show one part, which is a triangle, the cross product of its sides."""
    made, labels = labelled
    ids, dense = labels["segmentation"], labels["dense_pose"].astype(np.float64)
    one = (ids[:-1, :-1] > 0) & (ids[:-1, :-1] == ids[1:, :-1]) & (ids[:-1, :-1] == ids[:-1, 1:])
    right, down = (dense[:-1, 1:] - dense[:-1, :-1])[one], (dense[1:, :-1] - dense[:-1, :-1])[one]
    across = np.cross(right, down)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    ray = np.concatenate([made.camera.centres(made.camera.frame)[:-1, :-1][one], np.ones((one.sum(), 1))], -1)
    across *= -np.sign((made.T_cam_body.directions(across) * ray).sum(-1, keepdims=True))
    found = labels["normals_body"][:-1, :-1][one]
    assert len(found) > 5000
    assert np.quantile(np.abs(across - found).max(-1), 0.999) < BENT


def test_normals_of_a_box_are_its_axes() -> None:
    labels = labels_of(scene(target(*box()), T_cam_body=pose((0.9, 0.3, -0.2, 0.1))))
    seen = labels["depth"] > 0
    normals = labels["normals_body"][seen]
    assert np.isin(np.abs(normals), (0, 1)).all()
    assert len(np.unique(normals, axis=0)) == 3  # a camera sees at most three sides of a box


def test_both_are_the_same_turned_by_the_pose(labelled) -> None:
    made, labels = labelled
    turned = made.T_cam_body.directions(labels["normals_body"].astype(np.float64))
    np.testing.assert_allclose(turned, labels["normals_cam"], rtol=0, atol=FLOAT32)


def test_a_sheet_is_seen_from_the_side_of_the_camera() -> None:
    """Whichever way the corners go around."""
    points, faces = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]]
    for turn in (faces, [face[::-1] for face in faces]):
        normals = labels_of(scene(target(points, turn)))["normals_cam"]
        np.testing.assert_array_equal(np.unique(normals[normals.any(-1)], axis=0), [[0, 0, -1]])


def test_what_is_right_has_no_fault(labelled) -> None:
    made, labels = labelled
    picture = picture_of(made, labels)
    assert [*faults_cam(picture), *faults_body(picture)] == []


def messages(faults):
    return [fault.message.partition(" of neighbouring")[0].rstrip("0123456789.e-% ") for fault in faults]


def test_wrong_normals_are_found(labelled) -> None:
    made, labels = labelled
    cam, body = labels["normals_cam"], labels["normals_body"]
    assert "normals_cam holds normals that face away from the camera" in messages(
        faults_cam(picture_of(made, labels, normals_cam=-cam))
    )
    assert messages(faults_cam(picture_of(made, labels, normals_cam=cam * np.float32(1.00001)))) == [
        "normals_cam holds normals whose length is off by",
        "normals_cam and normals_body differ by",
    ]
    assert [fault.code for fault in faults_body(picture_of(made, labels, normals_body=cam))] == ["normals"]
    less = np.where(np.indices(body.shape)[1] < 150, 0, body)
    assert "support" in [fault.code for fault in faults_body(picture_of(made, labels, normals_body=less))]


def test_a_target_of_few_pixels_may_show_parallel_planes_alone() -> None:
    """A flight of steps seen from above, each as wide as a pixel: no two neighbours are of one plane."""
    steps = [box((0.1 * i - 0.4, -0.4, -0.5), (0.1 * i - 0.3, 0.4, 0.05 * (i % 3))) for i in range(8)]
    points = np.concatenate([corners for corners, _ in steps])
    faces = np.concatenate([each + 8 * i for i, (_, each) in enumerate(steps)])
    small = Camera(width=12, height=12, fx=40.0, fy=40.0, cx=6.0, cy=6.0)
    made = scene(target(points, faces), camera=small, T_cam_body=pose((0, 1, 0, 0), (0, 0, 4)))
    labels = labels_of(made)
    assert np.count_nonzero(labels["depth"]) >= 50
    assert [*faults_body(picture_of(made, labels))] == []
