import cv2
import numpy as np
import pytest

from spin_usd.accuracy.error import LabelImages, Viewpoint, agreement
from tests.cases.scenes import SPEEDPLUS, pose

SHAPE = (SPEEDPLUS.height, SPEEDPLUS.width)
POSE = pose((0.9, 0.1, -0.3, 0.2), (0.1, -0.05, 6.0))


def labels(shift=0.0, near=0.0):
    """A box of pixels of three parts whose body points lie on their pixels' rays, `shift` pixels to the right, `near`
    metres nearer."""
    depth, part, body = np.zeros(SHAPE), np.zeros(SHAPE, np.uint16), np.zeros((*SHAPE, 3))
    rows, columns = (index.ravel() for index in np.mgrid[500:560, 900:1000])
    centres = np.stack([columns + 0.5 + shift, rows + 0.5], -1)
    depth[rows, columns] = 6.0 - near
    points = (6.0 - near) * SPEEDPLUS.rays(centres)
    body[rows, columns] = POSE.inverse().points(points)
    part[rows, columns] = 1 + columns // 40 % 3
    return LabelImages(depth=depth.astype(np.float32), part=part, body=body.astype(np.float32))


def compared(ours, theirs):
    sight = Viewpoint(camera=SPEEDPLUS, T_cam_body=POSE)
    return agreement(ours, theirs, sight, frame="f", renderer="blender", against="raycast")


def test_equal_labels_agree() -> None:
    found = compared(labels(), labels())
    assert (found.iou, found.depth_m, found.part_pixels) == (1, 0, 0)
    assert found.reprojection_px < 1e-3  # float32 of the label


def test_a_shift_of_body_points_is_found_in_pixels_as_opencv_projects_them() -> None:
    ours = labels(shift=0.25)
    found = compared(ours, labels())
    seen = ours.part > 0
    rotation, _ = cv2.Rodrigues(POSE.rotation)
    projected, _ = cv2.projectPoints(
        ours.body[seen].astype(float), rotation, POSE.translation, SPEEDPLUS.matrix, np.array(SPEEDPLUS.distortion)
    )
    off = projected[:, 0] - np.argwhere(seen)[:, ::-1] - 0.5
    assert found.reprojection_px == pytest.approx(np.hypot(*off.T).max(), abs=1e-6)
    assert found.reprojection_px == pytest.approx(0.25, abs=1e-3)


def test_depth_parts_and_silhouette_are_counted_where_both_see() -> None:
    theirs = labels(near=0.125)
    theirs.part[500:560, 950:1000] = 0  # half of the silhouette
    theirs.part[500, 900:910] = 9
    found = compared(labels(), theirs)
    assert (found.iou, found.part_pixels) == (0.5, 10)
    assert found.depth_m == pytest.approx(0.125, rel=1e-6)


def test_two_empty_silhouettes_are_one() -> None:
    nothing = LabelImages(
        depth=np.zeros(SHAPE, np.float32), part=np.zeros(SHAPE, np.uint16), body=np.zeros((*SHAPE, 3), np.float32)
    )
    found = compared(nothing, nothing)
    assert (found.iou, found.depth_m, found.reprojection_px, found.part_pixels) == (1, 0, 0, 0)
    assert compared(nothing, labels()).iou == 0
