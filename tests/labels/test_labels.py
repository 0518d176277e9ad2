"""Labels agree with one another, and with the camera as OpenCV knows it."""

import cv2
import numpy as np
import pytest

from spin_usd.labels.table import PIXEL_LABELS
from tests.authorities.first_hit import first_hit
from tests.cases.labelled import labels_of, picture_of, surface_of
from tests.cases.scenes import BARREL, SMALL, box, pose, scene, soup, target

REPROJECTION_PX = 1e-4  # float32 of a body of a metre at four metres: 1e-5 px; the contract's bound is 1e-3
DEPTH_RELATIVE = 2e-7  # float32, twice
THIRD = 3  # every third pixel is enough
DOUBT = 1e-4  # barycentric: what a pixel of the ray caster's float32 may be off, and more
BEFORE_CAMERA = (0.1, 0.2, 0.56)
POSES = [((1, 0, 0, 0), (0, 0, 4)), ((0.5, -0.3, 0.7, 0.2), (1.6, -0.9, 3)), ((0.1, 0.9, -0.2, 0.4), (0.1, 0.1, 0.2))]


@pytest.fixture(params=[(camera, i) for camera in (SMALL, BARREL) for i in range(len(POSES))])
def labelled(request):
    """A scene, wholly in the frame, partly outside and around the camera, and its labels."""
    camera, i = request.param
    points, faces, parts = soup(i + 10, count=60)
    s = scene(target(points, faces, parts=parts), camera=camera, T_cam_body=pose(*POSES[i]))
    labels = labels_of(s)
    assert (labels["depth"] > 0).sum() > 100
    return s, labels


def test_shapes_and_types_are_the_contracts(labelled) -> None:
    s, labels = labelled
    for name, label in PIXEL_LABELS.items():
        channels = () if len(label.channels.names) == 1 else (len(label.channels.names),)
        assert labels[name].shape == (*s.camera.frame.shape, *channels)
        assert labels[name].dtype == np.dtype(label.channels.dtype)
        assert label.suffix == (".exr" if labels[name].dtype == np.float32 else ".png")


def test_each_pixel_shows_the_first_triangle_on_its_ray(labelled) -> None:
    """By another method of intersection, along rays that OpenCV undistorts; but for pixels at a triangle's edge."""
    s, labels = labelled
    hit = first_hit(
        rays(s.camera)[::THIRD], s.T_cam_body.points(s.target.mesh.points)[s.target.mesh.faces], doubt=DOUBT
    )
    assert hit.sure.mean() > 0.95
    part = np.where(hit.face < 0, 0, s.target.mesh.face_part[hit.face])
    depth = np.where(hit.face < 0, 0, hit.distance)
    assert len(np.unique(part[hit.sure])) > 5
    np.testing.assert_array_equal(labels["segmentation"].ravel()[::THIRD][hit.sure], part[hit.sure])
    np.testing.assert_allclose(labels["depth"].ravel()[::THIRD][hit.sure], depth[hit.sure], rtol=1e-5, atol=1e-6)


def test_all_cover_the_same_pixels(labelled) -> None:
    _, labels = labelled
    seen = labels["segmentation"] > 0
    for name, array in labels.items():
        there = array > 0 if array.ndim == 2 else array.any(-1)
        np.testing.assert_array_equal(there, seen & (PIXEL_LABELS[name].takes is None), err_msg=name)  # no other view


def rays(camera):
    """Through the pixels' centres, at depth 1 (H x W, 3)."""
    rows, columns = np.indices(camera.frame.shape).reshape(2, -1) + 0.5
    centres = np.stack([columns, rows], -1)[:, None]
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    distortion = np.array(camera.distortion)
    xy = cv2.undistortPoints(centres, camera.matrix, distortion, criteria=stop)[:, 0]
    return np.concatenate([xy, np.ones((len(xy), 1))], 1)


def test_dense_pose_projects_onto_its_own_pixels(labelled) -> None:
    s, labels = labelled
    rows, columns = np.nonzero(labels["segmentation"])
    points = s.T_cam_body.points(labels["dense_pose"][rows, columns])
    zero, distortion = np.zeros(3), np.array(s.camera.distortion)
    far = points[:, 2] > 0.3  # nearer, float32 of the body's size is worth more than the tolerance
    uv = cv2.projectPoints(points[far][:, None], zero, zero, s.camera.matrix, distortion)[0][:, 0]
    centres = np.stack([columns + 0.5, rows + 0.5], -1)[far]
    np.testing.assert_allclose(uv, centres, rtol=0, atol=REPROJECTION_PX)


def test_depth_is_the_z_of_dense_pose(labelled) -> None:
    s, labels = labelled
    seen = labels["segmentation"] > 0
    z = s.T_cam_body.points(labels["dense_pose"][seen])[:, 2]
    size = s.target.mesh.radius
    np.testing.assert_allclose(labels["depth"][seen], z, rtol=DEPTH_RELATIVE, atol=DEPTH_RELATIVE * size)


def test_part_ids_of_sixteen_bits_survive() -> None:
    points, faces, _ = soup(1, count=3)
    many = target(points, faces, parts=np.array([1, 40000, 65535]))
    s = scene(many)
    ids = PIXEL_LABELS["segmentation"].make(s, surface_of(s))
    assert set(np.unique(ids)) == {0, 1, 40000, 65535}


def test_nothing_visible_is_an_empty_frame() -> None:
    s = scene(target(*soup(0)[:2]), T_cam_body=pose(t=(0, 0, -9)))
    for array in labels_of(s).values():
        assert array.shape[:2] == s.camera.frame.shape
        assert not array.any()


def test_labels_of_a_target_right_before_the_camera_agree() -> None:
    """Float32 coordinates of a metre are off by much of a range of millimetres."""
    s = scene(target(*box()), T_cam_body=pose((0.3, 0.5, 0.7, -0.2), BEFORE_CAMERA))
    labels = labels_of(s)
    assert labels["depth"][labels["depth"] > 0].min() < 5e-3
    picture = picture_of(s, labels)
    assert [fault for name in labels for fault in PIXEL_LABELS[name].faults(picture)] == []
