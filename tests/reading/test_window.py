"""Crops and other sizes keep camera, keypoints, boxes and pixels together, to the half pixel."""

import pickle

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.reading.dataset import Dataset
from spin_usd.reading.window import Window

SIZES = [64, (96, 64), (31, 77)]


@pytest.fixture(scope="module")
def dataset(rendered):
    return Dataset(rendered)


def project(picture, points):
    return picture.camera.project(points @ picture.T_cam_body[:3, :3].T + picture.t_cam_body)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("margin", [-0.5, 0.0, 0.3, 4.0])
def test_keypoints_and_boxes_of_a_crop_are_those_of_its_camera(dataset, size, margin) -> None:
    """By the projection through the crop's own K."""
    for whole in dataset:
        picture = whole.crop("tango", size, margin=margin)
        target = picture.targets["tango"]
        assert np.nanmax(np.abs(project(picture, picture.keypoints.points) - target.keypoints)) < 1e-9
        assert np.nanmax(np.abs(picture.keypoint_pixels - target.keypoints)) < 1e-9
        corners = [[x, y, z] for x in target.box[:, 0] for y in target.box[:, 1] for z in target.box[:, 2]]
        assert np.nanmax(np.abs(project(picture, np.array(corners)) - target.box_3d)) < 1e-9
        assert picture.image.shape[:2] == picture.depth.shape == (picture.camera.height, picture.camera.width)
        inside = ((target.keypoints >= 0) & (target.keypoints < picture.window.size)).all(-1)
        assert not any(
            state == "visible" for state, there in zip(target.keypoint_states, inside, strict=True) if not there
        )


@pytest.mark.parametrize("size", SIZES)
def test_the_box_of_a_crop_is_in_its_middle_and_leaves_the_margin(dataset, size) -> None:
    for whole in dataset:
        picture = whole.crop(size=size, margin=0.25)
        x0, y0, x1, y1 = picture.targets[0].box_visible
        width, height = picture.window.size
        assert (x0 + x1, y0 + y1) == pytest.approx((width, height), abs=1e-9)
        assert max((x1 - x0) / width, (y1 - y0) / height) == pytest.approx(1 / 1.25)
        assert picture.camera.fx / picture.camera.fy == pytest.approx(whole.camera.fx / whole.camera.fy)


@pytest.mark.parametrize("size", [(240, 150), (480, 300), (100, 100), 37])
def test_the_dense_pose_is_projected_into_the_pixel_that_shows_it(dataset, size) -> None:
    """Each label is that of the picture's pixel in which the centre lies: half of such a pixel off at most."""
    for picture in (dataset[0].resize(size), dataset[0].crop(size=size)):
        rows, columns = np.nonzero(picture.segmentation)
        pixels = project(picture, picture.dense_pose[rows, columns].astype(np.float64))
        off = np.abs(pixels - np.stack([columns + 0.5, rows + 0.5], -1))
        assert (off < picture.window.scale / 2 + 1e-3).all()
        assert np.array_equal(picture.depth > 0, picture.segmentation > 0)


def test_the_same_size_has_the_same_pixels(dataset) -> None:
    whole = dataset[0]
    picture = whole.resize((whole.camera.width, whole.camera.height))
    assert np.array_equal(picture.image, whole.image)
    assert np.array_equal(picture.depth, whole.depth)
    assert picture.camera == whole.camera
    assert picture != whole


def board(squares: int, side: int) -> np.ndarray:
    """A board of black and white squares, with a white margin of one square."""
    dark = np.pad(np.indices((squares, squares)).sum(0) % 2 == 0, 1)
    sharp = np.where(dark, 30, 220).astype(np.uint8).repeat(side, 0).repeat(side, 1)
    return cv2.GaussianBlur(sharp, (0, 0), 1.5)  # OpenCV is off by 0.1 pixels of edges that are sharper


@pytest.mark.parametrize("factor", [0.5, 0.77, 1.0, 1.9])
@pytest.mark.parametrize("place", [(0.0, 0.0), (7.3, 12.6)])
def test_corners_of_a_board_are_where_the_window_puts_them(factor, place) -> None:
    """OpenCV finds the corners, with (0, 0) at the first pixel's centre: that is the half pixel."""
    side, squares = 24, 8
    image = board(squares, side)
    width = image.shape[1] - 20
    size = round(width * factor)
    window = Window(x0=place[0], y0=place[1], width=width, height=width, size=(size, size))
    shown = window.cut(image, 0, smooth=True)
    there = np.array([[c, r] for r in range(2, squares + 1) for c in range(2, squares + 1)], np.float64) * side
    wanted = window.pixels(there)
    start = (wanted - 0.5).astype(np.float32)[:, None]
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
    found = cv2.cornerSubPix(shown, start + 0.3, (4, 4), (-1, -1), criteria)[:, 0] + 0.5
    off = (found - wanted) / max(factor, 1)  # in pixels of the board: what it shows finer is no better known
    assert np.abs(off).max() < 0.1
    assert np.abs(off.mean(0)).max() < 0.05


def test_beyond_the_edge_there_is_nothing_and_rows_are_left_out_that_nobody_sees() -> None:
    image = np.full((40, 60), 200, np.uint8)
    window = Window(x0=-30, y0=-20, width=60, height=40, size=(30, 20))
    for smooth in (True, False):
        shown = window.cut(image, 0, smooth=smooth)
        assert (shown[:9, :] == 0).all()
        assert (shown[:, :14] == 0).all()
        assert (shown[11:, 16:] == 200).all()
    low = Window(x0=5, y0=30.5, width=10, height=4, size=(20, 8))
    noise = np.random.default_rng(0).integers(0, 255, (40, 60), np.uint8)
    for smooth in (True, False):
        rows = low.rows(40)
        assert len(rows) < 10
        some = low.cut(noise[rows.start : rows.stop], rows.start, smooth=smooth)
        assert np.array_equal(some, low.cut(noise, 0, smooth=smooth))


@given(st.integers(1, 400), st.integers(1, 400), st.floats(-50, 50), st.floats(1, 500), st.floats(0.5, 30))
def test_a_window_of_a_window_is_a_window(width, height, x0, side, part) -> None:
    outer = Window(x0=x0, y0=-x0, width=side, height=side, size=(width, height))
    inner = Window(x0=1.5, y0=-2.5, width=part, height=2 * part, size=(33, 44))
    points = np.array([[3.0, 4.0], [-7.0, 100.0]])
    camera = Camera(width=500, height=500, fx=300, fy=310, cx=250, cy=240)
    assert inner.of(outer).pixels(points) == pytest.approx(inner.pixels(outer.pixels(points)), rel=1e-6, abs=1e-6)
    there, here = inner.of(outer).camera(camera), inner.camera(outer.camera(camera))
    assert there.matrix == pytest.approx(here.matrix, rel=1e-6, abs=1e-6)


def test_a_dataset_of_crops_is_a_dataset(dataset) -> None:
    crops = dataset.crop("tango", 48, margin=0.2)
    assert crops.names == dataset.names
    assert crops[0] == dataset[0].crop("tango", 48, margin=0.2) != dataset[0]
    again = pickle.loads(pickle.dumps(crops))
    assert np.array_equal(again[1].image, crops[1].image)
    assert crops[1:].resize(24)[0].image.shape[:2] == (24, 24)
    batch = Dataset.collate(list(crops), labels=("image", "depth"))
    assert batch["image"].shape[:3] == batch["depth"].shape == (len(crops), 48, 48)
    assert np.array_equal(batch["keypoints"][1], crops[1].targets[0].keypoints)
    with pytest.raises(InputError, match=r"cannot be stacked: image is .* try dataset.resize"):
        Dataset.collate([dataset[0], crops[0]])


@pytest.mark.parametrize("factor", [2, 3, 4, 2.5, 6])
def test_labels_move_neither_way_when_a_picture_is_made_smaller(factor) -> None:
    """What a pixel shows of a label that says where it is, is on average its own centre."""
    side = 120
    where = np.stack(np.meshgrid(np.arange(side) + 0.5, np.arange(side) + 0.5), -1)
    count = round(side / factor)
    window = Window(x0=0.0, y0=0.0, width=float(side), height=float(side), size=(count, count))
    centres = np.stack(np.meshgrid(*[(np.arange(count) + 0.5) * side / count] * 2), -1)
    off = window.cut(where, 0, smooth=False) - centres
    assert np.abs(off).max() <= 0.5 + 1e-9
    assert np.abs(off.mean((0, 1))).max() < 1e-9


def test_a_batch_has_the_types_that_are_asked_for(dataset) -> None:
    types = {"segmentation": "int64", "T_cam_body": "float32", "image": "uint8"}
    batch = Dataset.collate(list(dataset), labels=("image", "segmentation"), types=types)
    assert {name: str(batch[name].dtype) for name in types} == types
    assert (batch["segmentation"] > 0).any()
    with pytest.raises(InputError, match="no array 'frame' to be int64"):
        Dataset.collate(list(dataset), types={"frame": "int64"})
    with pytest.raises(InputError, match="cannot be of the type 'intt'"):
        Dataset.collate(list(dataset), types={"T_cam_body": "intt"})


@pytest.mark.parametrize("size", [0, -3, 2.5, (10,), (10, 0), (1, 2, 3), 10**6])
def test_no_size_is_refused(dataset, size) -> None:
    with pytest.raises(InputError, match="of size"):
        dataset[0].resize(size)


def test_splits_are_disjoint_and_of_their_shares(dataset) -> None:
    first, second = dataset.split(0.5, 0.5, seed=3)
    assert sorted((*first.names, *second.names)) == sorted(dataset.names)
    assert [part.names for part in dataset.split(0.5, 0.5, seed=3)] == [first.names, second.names]
    assert len({dataset.split(0.34, seed=seed)[0].names for seed in range(20)}) > 1
    assert [len(part) for part in dataset.split(1 / 3, 1 / 3, by="picture")] == [1, 1]
    for wrong in ((), (0.5, 0.6), (0.0, 1.0), (float("nan"),)):
        with pytest.raises(InputError, match="are invalid"):
            dataset.split(*wrong)
    with pytest.raises(InputError, match="choose among pose, picture"):
        dataset.split(1.0, by="day")
