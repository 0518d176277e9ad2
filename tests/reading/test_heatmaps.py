"""Heatmaps have their maxima, between the pixels too, where the keypoints are."""

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.picture import heatmaps_of

FLOAT32_PX = 1e-3  # a parabola through logarithms of float32, of a Gaussian of 2 px


@pytest.fixture(scope="module")
def picture(rendered):
    return Dataset(rendered)[0]


def summit(heatmap):
    """The place of the maximum of a Gaussian: of the parabola through the logarithms around its highest pixel."""
    row, column = np.unravel_index(heatmap.argmax(), heatmap.shape)
    patch = np.log(heatmap[row - 1 : row + 2, column - 1 : column + 2].astype(np.float64))

    def aside(before, at, after):
        return (before - after) / (2 * (before - 2 * at + after))

    return column + 0.5 + aside(*patch[1]), row + 0.5 + aside(*patch[:, 1])


def test_the_maxima_are_the_keypoints(picture) -> None:
    maps = picture.heatmaps(size=(192, 128), sigma=2.0)
    assert maps.shape == (len(picture.keypoints.names), 128, 192)
    assert maps.dtype == np.float32
    wanted = picture.keypoint_pixels * (192 / picture.camera.width, 128 / picture.camera.height)
    assert np.abs(np.array([summit(each) for each in maps]) - wanted).max() < FLOAT32_PX


def test_sigma_is_of_the_maps_pixels(picture) -> None:
    """The sum of a Gaussian of height 1 is 2 pi sigma squared."""
    for sigma in (1.0, 2.5):
        sums = picture.heatmaps(size=(96, 64), sigma=sigma).sum((1, 2), dtype=np.float64)
        np.testing.assert_allclose(sums, 2 * np.pi * sigma**2, rtol=1e-3)


def test_keypoints_outside_the_frame_have_none() -> None:
    places = np.array([[-0.1, 5.0], [5.0, 8.1], [np.nan, np.nan], [0.0, 7.9]])
    maps = heatmaps_of(places, (16, 8), size=(32, 16), sigma=1.0)
    assert [bool(each.any()) for each in maps] == [False, False, False, True]


@pytest.mark.parametrize(("size", "sigma"), [((0, 4), 1.0), ((4, 4), 0.0), ((4, 4), float("nan"))])
def test_what_is_not_positive_is_refused(picture, size, sigma) -> None:
    with pytest.raises(InputError, match="heatmaps cannot be"):
        picture.heatmaps(size=size, sigma=sigma)


def test_the_relative_pose_takes_the_targets_points_along(rendered) -> None:
    one, other = Dataset(rendered)[:2]
    body = np.column_stack([one.keypoints.points, np.ones(len(one.keypoints.names))]).T
    np.testing.assert_allclose(
        one.relative_pose(other) @ (one.T_cam_body @ body), other.T_cam_body @ body, rtol=0, atol=1e-12
    )
