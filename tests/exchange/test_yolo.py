"""YOLO: shares of the image by hand, and labels that Ultralytics' own checks would take."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from spin_usd.errors import UnsupportedError
from spin_usd.exchange.yolo import box_numbers, keypoint_numbers, line_of
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import clone, write_export

SIZE = np.array([200.0, 100.0])


def exported(rendered, out, task):
    """Each label's numbers by its picture's name, and the text of data.yaml."""
    write_export(rendered, "yolo", out, options={"task": task}, split="train=0.6,validation=0.4")
    labels = {path.stem: path.read_text().split() for path in sorted(out.glob("labels/*/*.txt"))}
    images = sorted(path.relative_to(out / "images").with_suffix("") for path in out.glob("images/*/*.png"))
    assert images == sorted(path.relative_to(out / "labels").with_suffix("") for path in out.glob("labels/*/*.txt"))
    return {name: [float(text) for text in line] for name, line in labels.items()}, (out / "data.yaml").read_text()


def test_a_box_by_hand() -> None:
    assert box_numbers(np.array([20.0, 30, 60, 90]), SIZE) == pytest.approx([0.2, 0.6, 0.2, 0.6])
    assert line_of(0, [0.2, 1 / 3, 1.0]) == "0 0.2 0.333333333 1"


def test_keypoints_by_hand(rendered) -> None:
    target = replace(
        Dataset(rendered)[0].targets[0],
        keypoints=np.array([[50, 25], [100, 50], [300, 50]]),
        keypoint_states=("visible", "occluded", "outside"),
    )
    assert keypoint_numbers(target, SIZE, 4) == [0.25, 0.25, 2, 0.5, 0.5, 1, 0, 0, 0, 0, 0, 0]


def test_boxes_are_the_datasets(rendered, tmp_path) -> None:
    found, data = exported(rendered, tmp_path, "detect")
    assert data == 'train: images/train\nval: images/val\nnames:\n  0: "tango"\n'
    for name, (number, x, y, width, height) in found.items():
        box = [(x - width / 2) * 240, (y - height / 2) * 150, (x + width / 2) * 240, (y + height / 2) * 150]
        np.testing.assert_allclose(box, Dataset(rendered).picture(name).targets[0].box_visible, atol=1e-6)
        assert number == 0


def test_outlines_fill_the_mask(rendered, tmp_path) -> None:
    """Drawn 16 times as large, for OpenCV fills the pixels under an outline too."""
    for name, (_, *numbers) in exported(rendered, tmp_path, "segment")[0].items():
        mask = Dataset(rendered).picture(name).mask(1)
        large = np.zeros((150 * 16, 240 * 16), np.uint8)
        corners = np.reshape(numbers, (-1, 2)) * (240, 150) * 16
        cv2.fillPoly(large, [np.rint(corners).astype(np.int32)], 1)
        np.testing.assert_array_equal(large[8::16, 8::16], mask)


def test_poses_have_as_many_numbers_as_data_yaml_says(rendered, tmp_path) -> None:
    found, data = exported(rendered, tmp_path, "pose")
    assert "kpt_shape: [11, 3]\n" in data
    for name, line in found.items():
        picture = Dataset(rendered).picture(name)
        points = np.reshape(line[5:], (11, 3))
        seen = points[:, 2] > 0
        np.testing.assert_allclose((points[:, :2] * (240, 150))[seen], picture.keypoint_pixels[seen], atol=1e-6)


def test_keypoints_are_refused_where_there_are_none(rendered, tmp_path) -> None:
    dataset = clone(rendered, tmp_path / "set", [{"frame": "a"}])
    described = json.loads((dataset / "dataset.json").read_text())
    described["targets"][0]["keypoints"] = {}
    (dataset / "dataset.json").write_text(json.dumps(described))
    with pytest.raises(UnsupportedError, match="no target has keypoints, which yolo needs; author"):
        write_export(dataset, "yolo", tmp_path / "out", options={"task": "pose"})
    assert not (tmp_path / "out").exists()
