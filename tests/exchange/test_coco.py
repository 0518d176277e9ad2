"""COCO: boxes, masks and keypoints by hand, and as the dataset has them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from spin_usd.exchange.coco import annotation, keypoint_numbers
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import write_export
from tests.exchange.layout.test_masks import lengths_in

STATES = ("visible", "self-occluded", "occluded", "outside", "behind")


@pytest.fixture(scope="module")
def pictures(rendered):
    return Dataset(rendered)


def test_keypoints_are_at_whole_numbers_in_the_middle_of_pixels() -> None:
    """The middle of the pixel in column 3 and row 7 is (3, 7), and what is hidden, but there, has v = 1."""
    pixels = np.array([[3.5, 7.5], [4, 8], [5, 9], [-6, 2], [np.nan, np.nan]])
    assert keypoint_numbers(pixels, STATES) == [3, 7, 2, 3.5, 7.5, 1, 4.5, 8.5, 1, 0, 0, 0, 0, 0, 0]


def test_an_annotation_by_hand(pictures) -> None:
    """Columns 2 and 3, rows 1 to 3 of a picture of 5 x 6 pixels."""
    mask = np.zeros((6, 5), bool)
    mask[1:4, 2:4] = True
    seen = replace(
        pictures[0].targets[0],
        box_visible=np.array([2.0, 1, 4, 4]),
        keypoints=np.array([[2.5, 1.5], [9, 9]]),
        keypoint_states=("visible", "outside"),
    )
    assert annotation(seen, mask) == {
        "category_id": 1,
        "iscrowd": 0,
        "area": 6,
        "bbox": [2, 1, 2, 3],
        "segmentation": {"size": [6, 5], "counts": "=3305"},  # 13 3 3 3 8: from the fourth less 3
        "keypoints": [2, 1, 2, 0, 0, 0],
        "num_keypoints": 1,
    }


def test_the_file_says_what_the_dataset_does(rendered, pictures, tmp_path) -> None:
    write_export(rendered, "coco", tmp_path / "out", split="train=0.6,validation=0.4")
    found = [json.loads(path.read_text()) for path in sorted((tmp_path / "out" / "annotations").iterdir())]
    assert [len(each["images"]) for each in found] == [2, 1]
    for split, said in zip(("train", "validation"), found, strict=True):
        (category,) = said["categories"]
        assert (category["id"], category["name"], category["skeleton"]) == (1, "tango", [])
        assert tuple(category["keypoints"]) == pictures.keypoints.names
        for image, made in zip(said["images"], said["annotations"], strict=True):
            assert (tmp_path / "out" / "images" / split / image["file_name"]).is_file()
            picture = pictures.picture(image["file_name"].removesuffix(".png"))
            assert (image["width"], image["height"]) == (240, 150)
            assert made["image_id"] == image["id"]
            mask = picture.mask(1)
            lengths = lengths_in(made["segmentation"]["counts"])
            decoded = np.repeat(np.arange(len(lengths)) % 2 == 1, lengths).reshape((150, 240), order="F")
            np.testing.assert_array_equal(decoded, mask)
            assert made["area"] == mask.sum()
            x, y, width, height = made["bbox"]
            assert picture.targets[0].box_visible.tolist() == [x, y, x + width, y + height]
            points = np.reshape(made["keypoints"], (-1, 3))
            labelled = points[:, 2] > 0
            assert made["num_keypoints"] == labelled.sum() > 0
            np.testing.assert_allclose(points[labelled, :2] + 0.5, picture.keypoint_pixels[labelled])
    ids = [made["id"] for said in found for made in said["annotations"]]
    assert len(set(ids)) == 3
    assert min(ids) > 0
