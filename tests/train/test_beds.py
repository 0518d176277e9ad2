"""Real pictures that rows are tried on: the folder of SPEED+, or a folder of few pictures with one pose list."""

import csv
import json

import cv2
import numpy as np
import pytest

from spin_usd.exchange.cameras.speed_camera import read_camera_file
from tests.conftest import speedplus_camera

SAME = 1e-9  # of a length or an angle: numbers that were written and read
POSES = [
    {"filename": f"img{i}.png", "q_vbs2tango_true": [1, 0, 0, 0], "r_Vo2To_vbs_true": [0, 0, 4 + i]} for i in range(5)
]


@pytest.fixture
def flat(tmp_path):
    """A folder with five pictures and their poses, without a camera."""
    folder = tmp_path / "few" / "bed"
    folder.mkdir(parents=True)
    (folder / "poses.json").write_text(json.dumps(POSES))
    for place, pose in enumerate(POSES):
        cv2.imwrite(str(folder / pose["filename"]), np.full((1200, 1920), 10 * place, np.uint8))
    return folder


def test_beds_that_are_there_are_found(tmp_path, flat) -> None:
    from train.experiment import beds_of

    assert beds_of(flat) == {"poses": flat / "poses.json"}
    (flat / "camera.json").write_text("{}")
    assert beds_of(flat) == {"poses": flat / "poses.json"}
    (tmp_path / "lightbox").mkdir()
    (tmp_path / "lightbox" / "test.json").write_text("[]")
    assert beds_of(tmp_path) == {"lightbox": tmp_path / "lightbox" / "test.json"}


@pytest.mark.parametrize("lists", [(), ("one.json", "two.json")])
def test_a_folder_without_a_bed_is_refused(tmp_path, lists) -> None:
    from train.experiment import beds_of

    for name in lists:
        (tmp_path / name).write_text("[]")
    with pytest.raises(SystemExit, match=f"neither lightbox/test.json nor .* it has {len(lists)}"):
        beds_of(tmp_path)


def test_pictures_beside_their_list_are_read(flat) -> None:
    """With SPEED+'s camera, unless the folder has its own."""
    from train.pictures import CAMERA, read_set

    keypoints = flat.parent / "points.json"
    keypoints.write_text(json.dumps([[0, 0, 0], [1, 0, 0]]))
    found = read_set(flat / "poses.json", keypoints=keypoints).pictures
    assert [int(each.image()[0, 0]) for each in found] == [0, 10, 20, 30, 40]
    assert found[0].camera == read_camera_file(CAMERA).camera
    assert json.loads(CAMERA.read_text())["cameraMatrix"] == speedplus_camera()["cameraMatrix"]
    (flat / "camera.json").write_text(json.dumps(speedplus_camera(divide=2)))
    assert read_set(flat / "poses.json", keypoints=keypoints).pictures[0].camera.width == 960


def test_an_interval_holds_the_score_and_has_no_width_where_all_errors_are_equal(tmp_path, flat) -> None:
    from train.experiment import _intervals

    def intervals(degrees):
        half = np.radians(degrees) / 2
        with (tmp_path / "found.csv").open("w") as file:
            rows = csv.writer(file)
            rows.writerow(("filename", "qw", "qx", "qy", "qz", "x", "y", "z"))
            for pose, at in zip(POSES, half, strict=True):
                rows.writerow((pose["filename"], np.cos(at), np.sin(at), 0, 0, *pose["r_Vo2To_vbs_true"]))
        return _intervals(tmp_path / "found.csv", flat / "poses.json")

    equal = intervals([30.0] * 5)
    assert equal["attitude_deg_median"] == pytest.approx([30, 30], abs=SAME)
    assert equal["speedplus"] == pytest.approx([np.pi / 6] * 2, abs=SAME)
    low, high = intervals([10.0, 20.0, 30.0, 40.0, 150.0])["attitude_deg_median"]
    assert (low, high) == pytest.approx((10, 150), abs=SAME)


def test_sets_of_one_target_are_read_as_one(flat) -> None:
    from train.pictures import read_sets

    points = flat.parent / "points.json"
    points.write_text("[[0, 0, 0]]")
    both = read_sets([flat / "poses.json"] * 2, frames="::2", keypoints=points)
    assert [each.name for each in both.pictures] == ["img0", "img2", "img4"] * 2
