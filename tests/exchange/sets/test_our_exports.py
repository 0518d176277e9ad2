"""Sets in the layouts of others, read as they lie: our exports, whose labels must be those of the dataset's records."""

import csv

import numpy as np
import pytest

from spin_usd import Dataset
from spin_usd.errors import InputError
from spin_usd.exchange.sets.set_folder import SetFolder
from spin_usd.exchange.sets.table import guessed, read_set
from spin_usd.geometry.rotation import matrices_from_quaternions
from tests.cases.foreign_sets import BOXED, COUNT, KEYPOINTS, LAYOUTS, MASKED, POSED

EXACT = 1e-12
NINE_DIGITS = 1e-6  # pixels: YOLO's shares have nine digits
CAMERAS = ("speedplus", "speed", "shirt", "bop", "swisscube", "kitti")
DEPTHS = ("spark 2021", "bop", "kitti")
MASKS = (*MASKED, "coco", "yolo segment")


@pytest.fixture(scope="module")
def pictures(foreign_sets):
    """The dataset's pictures by their frames."""
    return {picture.frame: picture for picture in Dataset(foreign_sets.dataset)}


def pairs(foreign_sets, pictures, name):
    """Return the set, and each of its pictures beside the dataset's."""
    folder = foreign_sets.export(name)
    with (folder / "pictures.csv").open() as file:
        frames = {row["file"]: row["frame"] for row in csv.DictReader(file)}
    labels, _, _ = read_set(folder, None)
    return labels, [(each, pictures[frames[each.name]]) for each in labels.pictures]


@pytest.mark.parametrize("name", LAYOUTS)
def test_labels_are_those_of_the_records(foreign_sets, pictures, name) -> None:
    """No more is read than is there, and no less: each kind of labels is there in the layouts that have it, alone."""
    labels, found = pairs(foreign_sets, pictures, name)
    assert not labels.faults
    assert not labels.renamed
    assert not labels.unlabelled
    assert len({picture.frame for _, picture in found}) == len(found) == COUNT
    for each, picture in found:
        assert each.exists
        assert (each.camera is not None) == (name in CAMERAS)
        assert (each.depth is not None) == (name in DEPTHS)
        if name == "kitti":
            assert not each.targets
            continue
        (target,) = each.targets
        compare_pose(labels, target, picture, name)
        assert (target.box is not None) == (name in BOXED)
        if target.box is not None:
            np.testing.assert_allclose(target.box, picture.targets[0].box_visible, rtol=0, atol=NINE_DIGITS)
        assert (target.mask is not None) == (name in MASKS)
        compare_keypoints(target, picture, name)


def compare_pose(labels, target, picture, name) -> None:
    assert (target.rotation is not None) == (target.t_cam_body is not None) == (name in POSED)
    if name in POSED:
        R = target.rotation
        R = matrices_from_quaternions(labels.q_cam_body(R[None]))[0] if R.shape == (4,) else R
        np.testing.assert_allclose(R, picture.T_cam_body[:3, :3], rtol=0, atol=EXACT)
        np.testing.assert_allclose(target.t_cam_body, picture.T_cam_body[:3, 3], rtol=0, atol=EXACT * 10)


def compare_keypoints(target, picture, name) -> None:
    assert (target.keypoints is not None) == (name in KEYPOINTS)
    if target.keypoints is not None:
        labelled = target.keypoints[:, 2] > 0
        assert labelled.any()
        seen = picture.keypoint_pixels[labelled]
        np.testing.assert_allclose(target.keypoints[labelled, :2], seen, rtol=0, atol=NINE_DIGITS)


@pytest.mark.parametrize("name", CAMERAS)
def test_cameras_are_the_datasets(foreign_sets, pictures, name) -> None:
    """In our convention: (0, 0) is the image's corner, wherever the layout has it."""
    _, found = pairs(foreign_sets, pictures, name)
    for each, picture in found:
        assert (each.camera.width, each.camera.height) == (picture.camera.width, picture.camera.height)
        np.testing.assert_allclose(each.camera.matrix, picture.camera_matrix, rtol=EXACT)


@pytest.mark.parametrize("name", LAYOUTS)
def test_splits_are_kept(foreign_sets, pictures, name) -> None:
    _, found = pairs(foreign_sets, pictures, name)
    with (foreign_sets.export(name) / "pictures.csv").open() as file:
        splits = {row["frame"]: row["split"] for row in csv.DictReader(file)}
    if name != "kitti":  # whose drives are no splits
        assert {picture.frame: each.split for each, picture in found} == splits


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_first_guess_is_the_layout_and_says_why(foreign_sets, name) -> None:
    layout, notes = guessed(SetFolder(foreign_sets.export(name)), None)
    assert layout.name == LAYOUTS[name].read_as
    assert notes[0].startswith(f"read as {layout.name}: ")


def test_a_layout_that_is_named_is_not_guessed(foreign_sets) -> None:
    labels, layout, notes = read_set(foreign_sets.export("yolo detect"), "speedplus")
    assert layout.name == "speedplus"
    assert notes == ["read as speedplus, as --layout says"]
    assert len(labels.pictures) == COUNT
    with pytest.raises(InputError, match="no layout 'speedpuls'") as refused:
        read_set(foreign_sets.export("speedplus"), "speedpuls")
    assert "speedplus" in str(refused.value.do)


def test_a_folder_of_no_layout_is_refused_with_the_names_of_all(tmp_path) -> None:
    (tmp_path / "notes.txt").write_text("nothing")
    with pytest.raises(InputError, match="no known layout") as refused:
        read_set(tmp_path, None)
    assert all(layout.read_as in str(refused.value.do) for layout in LAYOUTS.values())
