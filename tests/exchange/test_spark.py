"""SPARK and CubeSat-CDT: order of boxes and quaternions, folders, depth and masks, against numbers made by hand."""

import ast
import csv

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from tests.exchange.conftest import PLAIN, clone, write_export

HALF = 0.5**0.5
TURNED = [HALF, 0.0, 0.0, HALF]  # a quarter turn about z, scalar first
AT = [0.1, -0.2, 5.0]


@pytest.fixture(scope="module")
def turned(rendered, tmp_path_factory):
    pictures = [{"frame": "a", "q": TURNED, "t": AT, "camera": PLAIN}, {"frame": "b", "camera": PLAIN}]
    return clone(rendered, tmp_path_factory.mktemp("turned") / "dataset", pictures)


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("to", ["spark", "cubesat_cdt"])
def test_poses_have_the_scalar_last(turned, tmp_path, to) -> None:
    write_export(turned, to, tmp_path / "out")
    text = (tmp_path / "out" / "train.csv").read_text().splitlines()
    assert text[:2] == [
        "filename,sequence,Tx,Ty,Tz,Qx,Qy,Qz,Qw",
        f"a.png,GT001,0.1,-0.2,5.0,0.0,0.0,{HALF!r},{HALF!r}",
    ]
    assert (tmp_path / "out" / "train" / "images" / "GT001" / "a.png").is_file()


def test_scipy_reads_the_pose_and_projects_a_point(turned, tmp_path) -> None:
    """A quarter turn about z takes (1, 0, 0) to (0, 1, 0): u = 120 + 640 * 0.1 / 5, v = 75 + 640 * (1 - 0.2) / 5."""
    write_export(turned, "spark", tmp_path / "out")
    row = rows(tmp_path / "out" / "train.csv")[0]
    turn = Rotation.from_quat([float(row[name]) for name in ("Qx", "Qy", "Qz", "Qw")])
    x, y, z = turn.apply([1, 0, 0]) + [float(row[name]) for name in ("Tx", "Ty", "Tz")]
    assert (120 + 640 * x / z, 75 + 640 * y / z) == pytest.approx((132.8, 177.4), abs=1e-12)


def test_each_variant_is_a_sequence(rendered, tmp_path) -> None:
    pictures = [{"frame": "a", "variant": variant, "camera": PLAIN} for variant in ("nominal", "dim")]
    dataset = clone(rendered, tmp_path / "dataset", pictures)
    write_export(dataset, "spark", tmp_path / "out")
    found = [(row["filename"], row["sequence"]) for row in rows(tmp_path / "out" / "train.csv")]
    assert found == [("a-nominal.png", "GT001"), ("a-dim.png", "GT002")]


def tight_box(dataset, frame) -> tuple[int, int, int, int]:
    """Row and column of the first visible pixel, and one past the last."""
    ids = np.asarray(Image.open(dataset / "segmentation" / "nominal" / f"{frame}.png"))
    places = np.argwhere(ids)
    return (*places.min(0).tolist(), *(places.max(0) + 1).tolist())


def test_boxes_of_2021_have_rows_first(turned, tmp_path) -> None:
    write_export(turned, "spark", tmp_path / "out", options={"layout": "2021"}, split="train=0.5,validation=0.5")
    found = rows(tmp_path / "out" / "train_labels.csv") + rows(tmp_path / "out" / "validate_labels.csv")
    for row in found:
        frame = row["image"].removesuffix(".png")
        assert row["class"] == "tango"
        assert tuple(ast.literal_eval(row["bbox"])) == tight_box(turned, frame)
    train = rows(tmp_path / "out" / "train_labels.csv")[0]
    assert (tmp_path / "out" / "train_rgb" / "tango" / train["image"]).is_file()


def test_depth_of_2021_is_in_millimetres(turned, tmp_path) -> None:
    write_export(turned, "spark", tmp_path / "out", options={"layout": "2021"})
    depth = np.asarray(Image.open(tmp_path / "out" / "train_depth" / "tango" / "a_depth.png"))
    from spin_usd.reading.dataset import Dataset

    metres = Dataset(turned).picture("a").depth
    assert depth.dtype == np.uint16
    assert np.array_equal(depth > 0, metres > 0)
    assert np.abs(depth - 1000.0 * metres).max() <= 0.5 + 1e-3


def test_boxes_of_2022_have_rows_first(turned, tmp_path) -> None:
    write_export(turned, "spark", tmp_path / "out", options={"layout": "2022-stream1"})
    row = rows(tmp_path / "out" / "train.csv")[0]
    assert list(row) == ["filename", "class", "bbox"]
    assert tuple(ast.literal_eval(row["bbox"])) == tight_box(turned, "a")
    assert (tmp_path / "out" / "train" / row["filename"]).is_file()


def test_boxes_of_2024_have_columns_first_and_masks_are_red_and_blue(turned, tmp_path) -> None:
    write_export(turned, "spark", tmp_path / "out", options={"layout": "2024-stream1"})
    row = rows(tmp_path / "out" / "train.csv")[0]
    r0, c0, r1, c1 = tight_box(turned, "a")
    assert ast.literal_eval(row["Bounding box"]) == (c0, r0, c1, r1)
    assert list(row) == ["Class", "Image name", "Mask name", "Bounding box"]
    assert (tmp_path / "out" / "images" / "tango" / "train" / row["Image name"]).is_file()
    mask = np.asarray(Image.open(tmp_path / "out" / "mask" / "tango" / "train" / row["Mask name"])).astype(int)
    from spin_usd.reading.dataset import Dataset

    picture = Dataset(turned).picture("a")
    panels = [number for number, part in picture.parts.items() if part.class_name == "solar_panel"]
    expected = np.zeros(mask.shape, int)
    expected[picture.segmentation > 0] = (255, 0, 0)
    expected[np.isin(picture.segmentation, panels)] = (0, 0, 255)
    assert (mask.argmax(-1)[picture.segmentation > 0] == expected.argmax(-1)[picture.segmentation > 0]).mean() > 0.9
    assert np.abs(mask - expected).mean() < 4


def test_a_picture_without_the_target_is_left_out(rendered, tmp_path, blanked) -> None:
    report = write_export(blanked, "spark", tmp_path / "out", options={"layout": "2021"})
    assert (report.pictures, report.left_out) == (1, 1)
    assert [row["image"] for row in rows(tmp_path / "out" / "train_labels.csv")] == ["b.png"]
    assert "1 more show nothing of it, and are left out" in (tmp_path / "out" / "README.md").read_text()
