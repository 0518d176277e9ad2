"""A picture without distortion says of its targets what the camera without distortion sees."""

import numpy as np
import pytest

from spin_usd.exchange.layout.exported_dataset import ExportedPicture
from spin_usd.exchange.layout.rectified_picture import RectifiedPicture
from spin_usd.reading.dataset import Dataset
from spin_usd.scene.mesh import BOX
from tests.exchange.conftest import clone


def without_distortion(picture):
    exported = ExportedPicture(picture=picture, name="a", number=0, split="train", target_name=picture.targets[0].name)
    return RectifiedPicture.of(exported)


@pytest.fixture(scope="module")
def rectified(rendered):
    return without_distortion(Dataset(rendered)[0])


def pinhole(points, picture):
    """Pixels of points (N, 3) in the target's axes, by the camera's matrix alone."""
    seen = (points @ picture.T_cam_body[:3, :3].T + picture.T_cam_body[:3, 3]) @ picture.camera_matrix.T
    return seen[:, :2] / seen[:, 2:]


def test_points_are_where_the_matrix_alone_puts_them(rectified) -> None:
    picture, target = rectified.picture, rectified.targets[0]
    np.testing.assert_allclose(target.keypoints, pinhole(picture.keypoints.points, picture))
    low, high = picture.description.targets[0].box
    np.testing.assert_allclose(target.box_3d, pinhole(np.where(BOX, high, low), picture))
    assert target.keypoint_states == picture.targets[0].keypoint_states
    assert np.abs(target.keypoints - picture.targets[0].keypoints).max() > 0.1  # the lens did something


def test_what_is_counted_in_pixels_is_counted_anew(rectified) -> None:
    mask, target = rectified.mask(1), rectified.targets[0]
    rows, columns = np.nonzero(mask)
    assert target.box_visible.tolist() == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
    assert target.pixels_visible == target.pixels_amodal == mask.sum()
    assert np.isnan(target.box_amodal).all()
    np.testing.assert_array_equal(rectified.label("segmentation") > 0, mask)
    assert not rectified.camera.distorted


def test_a_point_that_leaves_the_frame_is_outside(rendered, tmp_path) -> None:
    """The record says that some are visible; where the pose now puts them, none is."""
    picture = Dataset(clone(rendered, tmp_path / "set", [{"frame": "a", "t": [9, 0, 5]}]))[0]
    assert "visible" in picture.targets[0].keypoint_states
    assert set(without_distortion(picture).targets[0].keypoint_states) == {"outside"}


def test_a_target_of_which_nothing_is_seen_has_no_box(blanked) -> None:
    target = without_distortion(Dataset(blanked).picture("a")).targets[0]
    assert target.pixels_visible == 0
    assert np.isnan(target.box_visible).all()
