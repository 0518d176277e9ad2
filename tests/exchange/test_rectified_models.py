"""COLMAP's and nerfstudio's models of distorted cameras: pinholes with rectify=yes, and fisheyes as they have them."""

import json

import numpy as np
import pytest

from spin_usd.errors import UnsupportedError
from spin_usd.exchange.read_camera import read_camera
from spin_usd.formats.image_file import read_image
from spin_usd.reading.dataset import Dataset
from tests.exchange.conftest import clone, write_export

EXACT_PX = 1e-9
FISHEYE = {"fx": 90.0, "fy": 91.0, "distortion": [0.012, -0.012, 0.02, -0.004], "model": "fisheye"}
RECTIFY = {"rectify": "yes"}


@pytest.fixture(scope="module")
def fisheye(rendered, tmp_path_factory):
    """A dataset whose records say that its camera is a fisheye."""
    return clone(rendered, tmp_path_factory.mktemp("fisheye") / "set", [{"frame": "a", "camera": FISHEYE}])


def test_a_rectified_colmap_model_is_of_pinholes_that_project_as_it_says(rendered, tmp_path) -> None:
    write_export(rendered, "colmap", tmp_path / "out", options=RECTIFY)
    write_export(rendered, "bop", tmp_path / "bop", options=RECTIFY)
    model = tmp_path / "out" / "sparse" / "0"
    (words,) = [line.split() for line in (model / "cameras.txt").read_text().splitlines() if line[0] != "#"]
    assert words[1] == "PINHOLE"
    fx, fy, cx, cy = map(float, words[4:])
    points = {
        int(row[0]): np.array(row[1:4], float)
        for row in map(str.split, (model / "points3D.txt").read_text().splitlines())
        if row[0] != "#"
    }
    rows = [line for line in (model / "images.txt").read_text().splitlines() if not line.startswith("#")]
    for head, seen in zip(rows[::2], rows[1::2], strict=True):
        picture = Dataset(rendered).picture(head.split()[-1].removesuffix(".png"))
        listed = np.reshape(np.array(seen.split(), float), (-1, 3))
        assert len(listed) > 100
        body = np.array([points[int(number)] for number in listed[:, 2]])
        x, y, z = (body @ picture.T_cam_body[:3, :3].T + picture.t_cam_body).T
        np.testing.assert_allclose(listed[:, :2], np.stack([fx * x / z + cx, fy * y / z + cy], -1), atol=EXACT_PX)
        ours = read_image(tmp_path / "out" / "images" / f"{picture.frame}.png")[0]
        theirs = read_image(next((tmp_path / "bop").rglob(f"gray/{picture.index:06d}.png")))[0]
        np.testing.assert_array_equal(np.squeeze(ours), np.squeeze(theirs))


def test_a_rectified_nerfstudio_scene_has_no_distortion(rendered, tmp_path) -> None:
    write_export(rendered, "nerfstudio", tmp_path / "out", options=RECTIFY)
    said = json.loads((tmp_path / "out" / "transforms.json").read_text())
    assert [said[name] for name in ("k1", "k2", "k3", "p1", "p2")] == [0.0] * 5


def test_a_fisheye_is_written_where_it_can_be_held(fisheye, tmp_path) -> None:
    camera = Dataset(fisheye).picture("a").camera
    assert camera.fisheye
    for to in ("colmap", "nerfstudio"):
        write_export(fisheye, to, tmp_path / to)
    assert read_camera(tmp_path / "colmap" / "sparse" / "0" / "cameras.txt").camera == camera
    said = json.loads((tmp_path / "nerfstudio" / "transforms.json").read_text())
    assert said["camera_model"] == "OPENCV_FISHEYE"
    assert [said[name] for name in ("k1", "k2", "k3", "k4")] == FISHEYE["distortion"]


@pytest.mark.parametrize("to", ["speedplus", "shirt", "webdataset", "croissant", "parquet", "spark", "speed", "bop"])
def test_other_formats_say_why_they_do_not_hold_it(fisheye, tmp_path, to) -> None:
    with pytest.raises(UnsupportedError, match=r"fisheye lens, and|has lens distortion"):
        write_export(fisheye, to, tmp_path / to)
