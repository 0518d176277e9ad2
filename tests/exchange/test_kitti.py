"""KITTI's raw recordings of a stereo pair with a LiDAR: its calibration projects, its PNGs are depth and disparity."""

import json
import shutil

import cv2
import numpy as np
import pytest
import trimesh

from spin_usd import Dataset, author
from spin_usd.errors import UnsupportedError
from tests.exchange.conftest import write_export

CAMERA = {"Nu": 96, "Nv": 72, "ppx": 1e-5, "ppy": 1e-5, "cameraMatrix": [[130, 0, 47], [0, 128, 35], [0, 0, 1]]}
BASELINE = 0.4
STEP = 1 / 256
HALF = 0.5  # pixels between the corner of an image and the centre of its first pixel
EXACT = 1e-9
POSES = [{"filename": f"p{i}.png", "q_vbs2tango_true": [0.8, 0.36, 0.48, 0], "r_Vo2To_vbs_true": [0.1 * i, 0.1, 4]} for i in range(2)]  # fmt: skip  # noqa: E501


@pytest.fixture(scope="module")
def rendered(tmp_path_factory, spin_usd):
    folder = tmp_path_factory.mktemp("kitti")
    trimesh.creation.box((1, 0.8, 0.6)).export(folder / "craft.stl")
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    (folder / "poses.json").write_text(json.dumps(POSES))
    made = {"poses": folder / "poses.json", "target": folder / "craft.stl", "units_per_metre": 1, "lidar": "flash"}
    cameras = (folder / "camera.json", f"right={folder / 'camera.json'}:{BASELINE},0,0")
    author(out=folder / "stage", camera=cameras, channels="rgb", **made)
    out = folder / "dataset"
    labels = ("--labels", "default,disparity,lidar")
    spin_usd("render", folder / "stage", "--out", out, "--renderer", "raycast", "--samples", "1", *labels)
    return out


@pytest.fixture(scope="module")
def kitti(rendered, tmp_path_factory):
    out = tmp_path_factory.mktemp("kitti") / "out"
    write_export(rendered, "kitti", out)
    return out


def numbers(file, name):
    lines = dict(line.split(": ", 1) for line in file.read_text().splitlines())
    return np.array(lines[name].split(), float)


def test_its_card_has_the_pixels_of_its_calibration(kitti) -> None:
    """One convention on the page: K of the table is that of the file, and no other place of the first pixel is said."""
    card = (kitti / "README.md").read_text()
    fx, _, cx, _, fy, cy, *_ = numbers(kitti / "nominal" / "calib_cam_to_cam.txt", "K_00")
    assert f"| 96 | 72 | {fx} | {fy} | {cx} | {cy} | none |" in card
    assert "Here (0, 0) is the first pixel's centre" in card
    assert "is the corner of the image" not in card


def drive(kitti):
    return kitti / "nominal" / "nominal_drive_0001_sync"


def test_its_projections_take_the_bodys_points_to_their_pixels(kitti, rendered) -> None:
    calibration = kitti / "nominal" / "calib_cam_to_cam.txt"
    for variant, number in (("nominal", "02"), ("nominal-right", "03")):
        picture = Dataset(rendered).picture("p1", variant)
        points = picture.dense_pose[picture.depth > 0].astype(np.float64)
        left = Dataset(rendered).picture("p1").T_cam_body
        in_first = points @ left[:3, :3].T + left[:3, 3]
        u, v, w = numbers(calibration, f"P_rect_{number}").reshape(3, 4) @ np.column_stack([in_first, np.ones(len(points))]).T  # fmt: skip  # noqa: E501
        rows, columns = np.nonzero(picture.depth)
        assert np.abs(u / w - columns).max() < 1e-3  # float32 of the dense pose
        assert np.abs(v / w - rows).max() < 1e-3


def test_opencv_reads_depth_and_disparity_in_steps_of_a_256th(kitti, rendered) -> None:
    for variant, camera in (("nominal", "image_02"), ("nominal-right", "image_03")):
        picture = Dataset(rendered).picture("p0", variant)
        shown = picture.depth > 0
        depth, occluded, seen = (
            np.asarray(cv2.imread(str(drive(kitti) / kind / camera / "0000000000.png"), cv2.IMREAD_UNCHANGED))
            for kind in ("proj_depth/groundtruth", "disp_occ", "disp_noc")
        )
        assert depth.dtype == occluded.dtype == np.uint16
        assert np.abs(depth * STEP - picture.depth).max() <= STEP / 2
        label = picture.label("disparity")
        assert np.abs(occluded * STEP - np.abs(label[..., 0])).max() <= STEP / 2 * (1 + EXACT) + 1e-4  # float32
        np.testing.assert_array_equal(occluded > 0, shown)
        np.testing.assert_array_equal(seen > 0, label[..., 2] == 1)


def test_points_lie_on_the_surface_that_the_calibration_takes_them_to(kitti, rendered) -> None:
    found = np.fromfile(drive(kitti) / "velodyne_points" / "data" / "0000000000.bin", "<f4").reshape(-1, 4)
    picture = Dataset(rendered).picture("p0")
    np.testing.assert_array_equal(found[:, :3], picture.lidar.points)
    calibration = kitti / "nominal" / "calib_velo_to_cam.txt"
    placed = found[:, :3] @ numbers(calibration, "R").reshape(3, 3).T + numbers(calibration, "T")
    np.testing.assert_allclose(placed, picture.lidar.points_cam, atol=EXACT)
    assert not (drive(kitti) / "velodyne_points" / "data" / "0000000002.bin").exists()


def test_cameras_that_are_no_pair_are_refused(rendered, tmp_path) -> None:
    with pytest.raises(UnsupportedError, match="is not a rectified pair"):
        write_export(turned(rendered, tmp_path), "kitti", tmp_path / "out")


def test_a_further_camera_without_the_first_is_refused(rendered, tmp_path) -> None:
    with pytest.raises(UnsupportedError, match="nominal-right: is of a further camera"):
        write_export(rendered, "kitti", tmp_path / "out", variants=["nominal-right"])


def test_a_rig_that_moves_and_a_pair_the_wrong_way_round_are_refused(rendered, tmp_path) -> None:
    for name, change, said in (
        ("moved", lambda t, frame: t if frame == "p0" else [0.5, 0, 0], "has another lens, or another place"),
        ("swapped", lambda t, frame: [-t[0], 0, 0], "not to the right of the other"),
    ):
        with pytest.raises(UnsupportedError, match=said):
            write_export(turned(rendered, tmp_path / name, change), "kitti", tmp_path / name / "out")


def turned(rendered, folder, change=lambda t, frame: [t[0], 0.5, t[2]]):
    """A copy of the dataset whose second camera stands elsewhere: half a metre lower, unless `change` says where."""
    shutil.copytree(rendered, folder / "turned", ignore=shutil.ignore_patterns("cache"))
    for record in (folder / "turned" / "records" / "nominal-right").iterdir():
        said = json.loads(record.read_text())
        said["rig"]["t_first_cam"] = change(said["rig"]["t_first_cam"], said["frame"])
        record.write_text(json.dumps(said))
    return folder / "turned"


def test_bop_has_the_same_pair_in_one_scene(rendered, tmp_path) -> None:
    """Its world is the first camera's: both cameras see the body's points where their poses put them."""
    write_export(rendered, "bop", tmp_path / "bop")
    scene = tmp_path / "bop" / "train" / "000000"
    assert [path.name for path in scene.parent.iterdir()] == ["000000"]
    camera, gt = (
        {name: json.loads((scene / f"{kind}_{name}.json").read_text())["0"] for name in ("camera", "right")}
        for kind in ("scene_camera", "scene_gt")
    )
    assert (scene / "rgb_right" / "000000.png").is_file()
    assert (scene / "mask_visib_right" / "000000_000000.png").is_file()
    R, t = (np.array(camera["right"][f"cam_{of}_w2c"]) for of in "Rt")
    np.testing.assert_allclose(R.reshape(3, 3), np.eye(3), atol=EXACT)
    np.testing.assert_allclose(t, [-1000 * BASELINE, 0, 0], atol=EXACT)
    for name in ("R", "t"):
        one, other = (np.array(gt[each][0][f"cam_{name}_m2c"]) for each in ("camera", "right"))
        np.testing.assert_allclose(one + (t if name == "t" else 0), other, atol=1e-6)  # millimetres
