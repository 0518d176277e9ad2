"""What users read exports with finds in them what the dataset says: pycocotools, webdataset, datasets, mlcroissant,
OpenCV 4, pandas, pycolmap and pykitti."""

import json
import subprocess
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import blank, clone

pytestmark = pytest.mark.slow

PICTURES = 3
COLMAP = 1e-6  # pixels, and metres: as far as pycolmap refines a point
LOSSY = 2.0  # levels of 255, on average, that the code of a video loses
BASELINE = 0.25  # metres
OPENCV = 1e-6  # pixels: two implementations of one formula in double precision


@pytest.fixture(scope="module")
def dataset(rendered):
    return rendered


@pytest.fixture
def read(readers, dataset, tmp_path, spin_usd):
    """What a reader makes of the dataset, exported to the format of its name."""

    def reader(name, *options, points=None, of=dataset, to=None):
        spin_usd("export", of, "--to", to or name, "--out", tmp_path / name, *options)
        if points is not None:
            (tmp_path / name / "points.json").write_text(points)
        script, out = Path(__file__).with_name("read_exports.py"), tmp_path / "found.json"
        subprocess.run([readers, script, name, tmp_path / name, out], check=True, capture_output=True, text=True)
        return json.loads(out.read_text())

    return reader


def test_pycocotools_finds_the_masks_and_scores_them(read, dataset) -> None:
    found = read("coco")
    assert found["precision"] == {"bbox": 1.0, "segm": 1.0, "keypoints": 1.0}
    assert len(found["annotations"]) == PICTURES
    for each in found["annotations"]:
        mask = Dataset(dataset).picture(each["file_name"].removesuffix(".png")).mask(1)
        np.testing.assert_array_equal(each["pixels"], np.flatnonzero(mask))
        assert {"area": each["area"], "bbox": each["bbox"]} == each["said"]
        assert each["category"] == "cubesat"


def test_webdataset_gives_each_picture_whole(read, dataset) -> None:
    found = read("webdataset", "--option", "pictures=2")
    assert [key for key, _ in found] == [frame for frame, _ in Dataset(dataset).names]
    for (_, files), picture in zip(found, Dataset(dataset), strict=True):
        files.pop("json")
        assert files.pop("record.txt") == sha256(record_file(dataset, picture).read_bytes()).hexdigest()
        recorded = picture.record["files"]
        assert files == {f"{kind}{Path(file['path']).suffix}": file["sha256"] for kind, file in recorded.items()}


def test_datasets_makes_a_table_of_records_that_differ(read, dataset, tmp_path) -> None:
    """The first shows nothing, has no Sun, names other layers; the second has a keypoint that the lens does not see."""
    others = clone(dataset, tmp_path / "others", [{"frame": name} for name in "abc"])
    blank(others, "a")
    edit(others, "a", lambda record: record.pop("sun"))
    edit(others, "a", lambda record: record["provenance"]["stage"]["files"].update({"more.usda": 64 * "0"}))
    edit(others, "a", lambda record: record["targets"][0].update(visible_fraction=None))
    edit(others, "b", lambda record: record["targets"][0]["keypoints"].__setitem__(0, [None, None, "behind"]))
    rows = read("datasets", of=others, to="webdataset")
    assert len(rows) == PICTURES
    for row, picture in zip(rows, Dataset(others), strict=True):
        (target,), (wanted,) = row["targets"], picture.targets
        assert (row["frame"], row["size"]) == (picture.frame, list(picture.image.shape[1::-1]))
        assert row["camera"] == picture.record["camera"]
        assert row["pose"] == picture.record["pose"] == target["pose"]
        assert target["keypoints"] == np.nan_to_num(wanted.keypoints).tolist()
        assert target["keypoint_states"] == list(wanted.keypoint_states)
        assert target["box"]["visible"] == np.nan_to_num(wanted.box_visible).tolist()
        assert row["record"] == record_file(others, picture).read_text()


def test_datasets_decodes_images_of_parquet_and_types_the_rest(read, dataset, tmp_path) -> None:
    """In shards of two, in splits; a keypoint that the lens does not see is null."""
    others = clone(dataset, tmp_path / "others", [{"frame": name} for name in "abc"])
    edit(others, "b", lambda record: record["targets"][0]["keypoints"].__setitem__(0, [None, None, "behind"]))
    blank(others, "c")
    options = ("--split", "train=0.7,test=0.3", "--option", "pictures=1", "--option", "depth=millimetres")
    found = read("parquet", *options, of=others)
    assert {split: len(rows) for split, rows in found.items()} == {"train": 2, "test": 1}
    for row in [row for rows in found.values() for row in rows]:
        picture = Dataset(others).picture(row["frame"])
        (target,), (wanted,) = row["targets"], picture.targets
        size = [*picture.image.shape[1::-1]]
        assert row["image"] == [*size, int(picture.image.astype(int).sum())]
        assert row["segmentation"] == [*size, int(picture.segmentation.astype(int).sum())]
        assert row["depth"] == [*size, int(np.rint(picture.depth.astype(float) * 1000).sum())]
        assert row["K"] == picture.camera_matrix.tolist()
        assert {"q_cam_body": row["q_cam_body"], "t_cam_body": row["t_cam_body"]} == picture.record["pose"]
        points = [None if np.isnan(point).any() else point.tolist() for point in wanted.keypoints]
        assert (target["keypoints"], target["keypoint_states"]) == (points, list(wanted.keypoint_states))
        assert target["box_visible"] == (None if row["frame"] == "c" else wanted.box_visible.tolist())


def test_opencv_decodes_the_video(read, dataset) -> None:
    found = read("video", "--option", "fps=5")
    assert found["fps"] == 5
    assert len(found["frames"]) == PICTURES
    for frame, picture in zip(found["frames"], Dataset(dataset), strict=True):
        apart = np.array(frame, float) - picture.image[..., None]
        assert np.abs(apart).mean() < LOSSY


def record_file(dataset, picture):
    return dataset / "records" / picture.variant / f"{picture.frame}.json"


def edit(dataset, frame, change) -> None:
    path = dataset / "records" / "nominal" / f"{frame}.json"
    record = json.loads(path.read_text())
    change(record)
    path.write_text(json.dumps(record))


def test_mlcroissant_joins_the_table_with_the_images(read, dataset) -> None:
    found = {row["texts"]["frame"]: row for row in read("croissant")}
    assert len(found) == PICTURES
    for picture in Dataset(dataset):
        row = found[picture.frame]
        assert [row["numbers"][f"q_{axis}"] for axis in "wxyz"] == picture.q_cam_body.tolist()
        assert [row["numbers"][f"t_{axis}"] for axis in "xyz"] == picture.t_cam_body.tolist()
        assert (row["numbers"]["k1"], row["numbers"]["cx"]) == (picture.camera.distortion[0], picture.camera.cx)
        assert (row["shape"][:2], row["sum"]) == (list(picture.image.shape), int(picture.image.astype(int).sum()))


def test_opencv_projects_keypoints_by_speedplus_files(read, dataset) -> None:
    pictures = list(Dataset(dataset))
    found = read("speedplus", points=json.dumps(pictures[0].keypoints.points.tolist()))
    for picture in pictures:
        np.testing.assert_allclose(found[picture.frame]["pixels"], picture.keypoint_pixels, atol=OPENCV)
        assert found[picture.frame]["image"] == list(picture.image.shape)
        np.testing.assert_array_equal(found[picture.frame]["mask"], np.flatnonzero(picture.mask(1)))


def test_pycolmap_projects_and_triangulates_the_points(read, dataset) -> None:
    found = read("colmap")
    assert found["observations"] > 1000
    assert found["tracks"] > 100
    assert max(found["projected"], found["triangulated"], found["apart"]) < COLMAP
    assert len(found["images"]) == PICTURES
    for picture in Dataset(dataset):
        image, camera = found["images"][f"{picture.frame}.png"], picture.camera
        np.testing.assert_allclose(image["pose"], picture.T_cam_body[:3], rtol=0, atol=COLMAP)
        k1, k2, p1, p2, k3 = camera.distortion
        sizes = [camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy]
        assert image["camera"] == ["FULL_OPENCV", *sizes, k1, k2, p1, p2, k3, 0, 0, 0]
        assert image["mask"]


def test_pandas_and_opencv_read_boxes_and_depth_of_spark(read, dataset) -> None:
    for row in read("spark", "--option", "layout=2021"):
        picture = Dataset(dataset).picture(row["image"].removesuffix(".png"))
        x0, y0, x1, y1 = picture.targets[0].box_visible.astype(int).tolist()
        assert json.loads(row["bbox"]) == [y0, x0, y1, x1]
        assert row["millimetres"] == round(1000 * float(picture.depth.max()))
        assert row["read"]


def test_pykitti_finds_a_stereo_pair_and_the_lidars_points_on_the_target(read, tmp_path, spin_usd) -> None:
    author = ("author", "--sample", "range=3..5 inside=1 count=2", "--target", "tango", "--lidar", "flash")
    pair = ("--camera", "spin", "--camera", f"right=spin:{BASELINE},0,0", "--resolution", "192", "--channels", "rgb")
    spin_usd(*author, *pair, "--out", tmp_path / "stage")
    made = tmp_path / "stereo"
    labels = ("--labels", "default,lidar", "--samples", "1")
    spin_usd("render", tmp_path / "stage", "--out", made, "--renderer", "raycast", *labels)
    found = read("kitti", of=made)
    left = Dataset(made)[0]
    assert found["pictures"] == 2
    assert {tuple(size) for size in found["sizes"]} == {(left.camera.width, left.camera.height)}
    assert found["baseline"] == pytest.approx(BASELINE, abs=COLMAP)
    pixels = left.camera.project(left.lidar.points_cam.astype(np.float64)) - 0.5  # centres at whole numbers
    np.testing.assert_allclose(found["pixels"], pixels, atol=1e-3)  # float32 of points
