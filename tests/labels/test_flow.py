"""Flow leads to where the next frame shows the same points; `check` finds where it does not."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from spin_usd.labels.displacement import PointState
from spin_usd.labels.flow import faults
from spin_usd.labels.table import PIXEL_LABELS
from spin_usd.scene.derived.surface import surface_points
from tests.cases.labelled import CASTER, followed, labels_of, picture_of
from tests.cases.scenes import BARREL, PINCUSHION, boxes, pose, scene, target, with_first

OFF_PX = 1e-3  # float32 of the dense pose at two metres, and of flow
SAME_M = 1e-5  # between the point and what the next frame's own ray meets there
NOW, NEXT = pose((0.9, -0.3, 0.2, 0.1), (0.1, 0.1, 2.5)), pose((0.9, 0.1, 0.5, 0.15), (0.9, -0.1, 2.2))


@pytest.fixture(scope="module")
def labelled():
    """Two boxes before a plate, which turn, and leave the frame in part."""
    made = scene(target(*boxes()), camera=BARREL, T_cam_body=NOW)
    made = followed(made, NEXT, camera=PINCUSHION)
    return made, labels_of(made)


def ends(labels):
    """Pixels (N, 2) in the next frame, body points (N, 3) and states (N,) of all points."""
    rows, columns = np.nonzero(labels["depth"])
    flow = labels["flow"][rows, columns].astype(np.float64)
    return np.stack([columns + 0.5, rows + 0.5], -1) + flow[:, :2], labels["dense_pose"][rows, columns], flow[:, 2]


def test_it_ends_where_opencv_projects_the_point(labelled) -> None:
    _, labels = labelled
    there, body, _ = ends(labels)
    turn, _ = cv2.Rodrigues(NEXT.rotation)
    lens = np.array(PINCUSHION.distortion)
    wanted = cv2.projectPoints(body.astype(np.float64), turn, NEXT.translation, PINCUSHION.matrix, lens)[0][:, 0]
    assert np.abs(there - wanted).max() < OFF_PX


def test_seen_points_are_what_the_next_frames_rays_meet_and_hidden_ones_are_not(labelled) -> None:
    """Rays from the next camera, where the label casts them from the points."""
    made, labels = labelled
    there, body, state = ends(labels)
    counts = np.bincount(state.astype(int), minlength=5)
    assert (counts[[PointState.SEEN, PointState.HIDDEN, PointState.OUTSIDE]] > 200).all()
    later = with_first(replace(made, camera=PINCUSHION, next_frame=None), T_cam_body=NEXT)
    inside = (state == PointState.SEEN) | (state == PointState.HIDDEN)
    xy = PINCUSHION.normalised(there[inside])
    face = CASTER.cast(later, xy)
    met = face >= 0
    _, found = surface_points(later, face[met], xy[met])
    apart = np.linalg.norm(found - body[inside][met], axis=1)
    seen = state[inside][met] == PointState.SEEN
    assert met.mean() > 0.999  # at its very edge a ray may miss
    assert (apart[seen] < SAME_M).mean() > 0.999
    assert (apart[~seen] > SAME_M).mean() > 0.999


def test_warped_labels_of_the_next_frame_are_those_of_this_one(labelled) -> None:
    """The dense pose of the next frame's pixel that a seen point falls into is within that pixel of it."""
    made, labels = labelled
    there, body, state = ends(labels)
    later = labels_of(with_first(replace(made, camera=PINCUSHION, next_frame=None), T_cam_body=NEXT))
    columns, rows = np.floor(there[state == PointState.SEEN]).astype(int).T
    shown = later["depth"][rows, columns] > 0
    found, wanted = (points.astype(np.float64)[shown] for points in (later["dense_pose"][rows, columns], body[state == PointState.SEEN]))  # fmt: skip  # noqa: E501
    pixels = PINCUSHION.project(NEXT.points(found)) - PINCUSHION.project(NEXT.points(wanted))
    assert np.abs(pixels).max() < 0.5 + OFF_PX
    assert np.quantile(np.linalg.norm(found - wanted, axis=1), 0.9) < 3 * 2.5 / PINCUSHION.fx


def test_nothing_moves_where_nothing_moves() -> None:
    made = scene(target(*boxes()), camera=BARREL, T_cam_body=NOW)
    flow = labels_of(followed(made, NOW))["flow"]
    assert np.abs(flow[..., :2]).max() < 1e-6
    assert (flow[..., 2] == PointState.SEEN).sum() > 10_000
    assert (flow[..., 2] > PointState.SEEN).sum() <= 2  # within float32 of an edge


def test_points_behind_the_next_camera_have_no_flow() -> None:
    made = scene(target(*boxes()), camera=BARREL, T_cam_body=NOW)
    flow = labels_of(followed(made, pose(t=(0, 0, -3))))["flow"]
    assert not flow[..., :2].any()
    assert set(np.unique(flow[..., 2])) == {0, PointState.UNSEEABLE}


def test_points_go_with_their_faces_where_the_target_changes_its_shape() -> None:
    points, faces = boxes()
    moved = points + np.array([0.1, -0.05, 0.02])
    made = scene(target(points, faces), camera=BARREL, T_cam_body=NOW)
    by_shape = labels_of(followed(made, NOW, target=target(moved, faces)))["flow"]
    shifted = replace(NOW, translation=NOW.points((0.1, -0.05, 0.02)))
    by_pose = labels_of(followed(made, shifted))["flow"]
    np.testing.assert_allclose(by_shape[..., :2], by_pose[..., :2], atol=OFF_PX)
    assert (by_shape[..., 2] == by_pose[..., 2]).mean() > 0.999
    other = labels_of(followed(made, NOW, target=target(points, faces[:-2])))["flow"]
    assert not other.any()


def test_its_key_depends_on_the_next_frame() -> None:
    made = scene(target(*boxes()), camera=BARREL, T_cam_body=NOW)
    keys = {PIXEL_LABELS["flow"].key(each, "g", 0) for each in (made, followed(made, NOW), followed(made, NEXT))}
    assert len(keys) == 3


def test_faults_are_found(labelled) -> None:
    made, labels = labelled
    assert list(faults(picture_of(made, labels))) == []
    off = labels["flow"] + np.array([0.01, 0, 0], np.float32)
    (fault,) = faults(picture_of(made, labels, flow=off))
    assert fault.message.startswith("flow ends 0.01")
    (fault,) = faults(picture_of(replace(made, next_frame=None), labels))
    assert fault.message.endswith("names no next frame")
