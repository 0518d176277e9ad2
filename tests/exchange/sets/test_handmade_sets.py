"""Layouts that we do not export, as minimal folders made by hand; and faults that readers note and go on."""

import json
from math import radians, tan

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.exchange.sets.table import read_set
from spin_usd.geometry.rotation import matrices_from_quaternions

EXACT = 1e-12
Q, T = [0.5, -0.1, 0.7, 0.5], [0.3, -0.2, 7.0]
POSE = {"q_vbs2tango_true": Q, "r_Vo2To_vbs_true": T}
K = [[300.0, 0, 32], [0, 300, 24], [0, 0, 1]]
CAMERA = {"Nu": 64, "Nv": 48, "cameraMatrix": K, "distCoeffs": [0, 0, 0, 0, 0]}


def save(path, content) -> None:
    """Write an image, text, or JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, np.ndarray):
        cv2.imwrite(str(path), content)
    else:
        path.write_text(content if isinstance(content, str) else json.dumps(content))


def image(path, size=(64, 48)) -> None:
    save(path, np.zeros(size[::-1], np.uint8))


def test_spe3r_has_craft_in_folders_with_file_names_without_endings(tmp_path) -> None:
    """Of each craft its own list, images, masks and model."""
    for craft in ("aqua", "cloudsat"):
        for number in range(2):
            image(tmp_path / craft / "images" / f"img{number:06}.jpg")
            image(tmp_path / craft / "masks" / f"img{number:06}.png")
        save(tmp_path / craft / "labels.json", [{"filename": f"img{number:06}", **POSE} for number in range(2)])
        save(tmp_path / craft / "models" / "model_normalized.obj", "v 0 0 0\n")
    save(tmp_path / "camera.json", CAMERA)
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "spe3r"
    assert not found.faults
    assert not found.unlabelled
    assert not found.renamed
    assert [picture.name for picture in found.pictures] == [
        f"{craft}/images/img{number:06}.jpg" for craft in ("aqua", "cloudsat") for number in range(2)
    ]
    assert dict(found.models) == {craft: f"{craft}/models/model_normalized.obj" for craft in ("aqua", "cloudsat")}
    for picture in found.pictures:
        (target,) = picture.targets
        assert picture.exists
        assert picture.camera.fx == K[0][0]
        assert picture.name.startswith(f"{target.id}/")
        assert target.mask.file == picture.name.replace("images", "masks").replace("jpg", "png")
        assert target.rotation.tolist() == Q
        assert target.t_cam_body.tolist() == T


def test_speed_ue_cube_has_file_names_without_endings(tmp_path) -> None:
    for split in ("train", "test"):
        image(tmp_path / "images" / f"{split}_0.png")
        save(tmp_path / f"{split}.json", [{"filename": f"{split}_0", **POSE}])
    save(tmp_path / "camera.json", CAMERA)
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "speedplus"
    assert {(picture.name, picture.split) for picture in found.pictures} == {
        (f"images/{split}_0.png", split) for split in ("train", "test")
    }
    assert all(picture.exists for picture in found.pictures)
    assert not found.renamed


def test_spacesense_is_turned_from_airsims_axes(tmp_path) -> None:
    """AirSim's camera looks along x, with y right and z down: SciPy turns the body's axes into OpenCV's as the reader
    does, and a target ahead of the camera is ahead."""
    folder = tmp_path / "aqua" / "train" / "01_approach_front"
    axes = "target_spacecraft_in_camera_"
    columns = [f"{axes}pos_{axis}(m)" for axis in "xyz"] + [f"{axes}quat_{axis}" for axis in "wxyz"]
    position, q = [12.0, 1.5, -0.25], (np.array(Q) / np.linalg.norm(Q)).tolist()
    cells = ["1700000000", *map(repr, position), *map(repr, q)]
    save(folder / "pose_ground_truth.csv", f"timestamp,{','.join(columns)}\n{','.join(cells)}\n")
    for kind in ("image", "seg"):
        image(folder / kind / "1700000000.png")
    (folder / "depth").mkdir()
    np.savez_compressed(folder / "depth" / "1700000000.npz", np.full((48, 64), 12000, np.int32))
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "spacesense"
    assert not found.faults
    (picture,) = found.pictures
    (target,) = picture.targets
    assert target.t_cam_body.tolist() == [1.5, -0.25, 12.0]
    x, y, z = Rotation.from_quat(q, scalar_first=True).as_matrix()
    R = matrices_from_quaternions(found.q_cam_body(target.rotation[None]))[0]
    np.testing.assert_allclose(R, [y, z, x], rtol=0, atol=EXACT)
    assert 2 * np.arctan(picture.camera.width / 2 / picture.camera.fx) == pytest.approx(radians(50))
    assert picture.camera.fx == pytest.approx(512 / tan(radians(25)))
    assert picture.depth.file.endswith("depth/1700000000.npz")
    assert picture.depth.metres == 1e-3
    assert target.id == "aqua"
    assert target.mask.file.endswith("seg/1700000000.png")


def speed(folder, entries) -> None:
    for number in range(2):
        image(folder / "images" / "train" / f"img{number}.jpg")
    save(folder / "train.json", entries)
    save(folder / "camera.json", CAMERA)


def test_speed_of_2019_without_a_camera_file_has_its_own_camera(tmp_path) -> None:
    speed(tmp_path, [{"filename": "img0.jpg", "q_vbs2tango": Q, "r_Vo2To_vbs_true": T}])
    (tmp_path / "camera.json").unlink()
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "speed"
    assert found.pictures[0].camera.width == 1920


def test_images_spelled_otherwise_are_found_and_said(tmp_path) -> None:
    """In another case, or in another folder; an image that no list has is unlabelled."""
    speed(tmp_path, [{"filename": "IMG0.JPG", **POSE}])
    found, _, _ = read_set(tmp_path, None)
    assert dict(found.renamed) == {"IMG0.JPG": "images/train/img0.jpg"}
    assert found.pictures[0].exists
    assert list(found.unlabelled) == ["images/train/img1.jpg"]


def test_an_ambiguous_name_is_not_guessed(tmp_path) -> None:
    speed(tmp_path, [{"filename": "IMG0.JPG", **POSE}])
    image(tmp_path / "images" / "validation" / "img0.jpg")
    found, _, _ = read_set(tmp_path, None)
    assert not found.pictures[0].exists
    assert not found.renamed


def test_numbers_that_are_none_are_nan_and_other_entries_are_read(tmp_path) -> None:
    wrong = {"filename": "img0.jpg", "q_vbs2tango_true": [1, "x", None, True], "r_Vo2To_vbs_true": [0.3]}
    speed(tmp_path, [wrong, {"filename": "img1.jpg", **POSE}, 7])
    found, _, _ = read_set(tmp_path, None)
    first, second, third = found.pictures
    np.testing.assert_array_equal(first.targets[0].rotation, [1, np.nan, np.nan, np.nan])
    np.testing.assert_array_equal(first.targets[0].t_cam_body, [0.3, np.nan, np.nan])
    assert second.targets[0].rotation.tolist() == Q
    assert not third.exists
    assert [fault.rule for fault in found.faults] == ["unreadable"]


def test_bops_boxes_are_of_whole_pixels(tmp_path) -> None:
    """BOP's width is the greatest pixel less the least, so a box reaches one pixel farther; -1 stands for none."""
    scene = tmp_path / "train" / "000000"
    pose = {"cam_R_m2c": np.eye(3).ravel().tolist(), "cam_t_m2c": [0, 0, 2000], "obj_id": 1}
    seen = [{"bbox_visib": [3, 4, 5, 6], "visib_fract": 0.5, "px_count_visib": 10, "px_count_all": 20}]
    save(scene / "scene_gt.json", {"0": [pose], "1": [pose]})
    save(scene / "scene_gt_info.json", {"0": seen, "1": [{"bbox_visib": [-1, -1, -1, -1], "visib_fract": 0.0}]})
    save(scene / "scene_camera.json", {key: {"cam_K": np.ravel(K).tolist(), "depth_scale": 0.1} for key in "01"})
    for number in range(2):
        image(scene / "rgb" / f"{number:06}.png")
        image(scene / "depth" / f"{number:06}.png")
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "bop"
    first, second = (picture.targets[0] for picture in found.pictures)
    assert first.box.tolist() == [3, 4, 9, 11]
    assert second.box is None
    assert (first.visible, first.pixels, first.whole) == (0.5, 10, 20)
    assert first.t_cam_body.tolist() == [0, 0, 2]
    assert found.pictures[0].camera.cx == K[0][2] + 0.5
    assert found.pictures[0].depth.metres == pytest.approx(1e-4)


def test_kitti_with_fewer_times_than_images_says_so(tmp_path) -> None:
    camera = tmp_path / "d_sync" / "image_02"
    for number in range(2):
        image(camera / "data" / f"{number:010}.png")
    save(camera / "timestamps.txt", "2011-09-26 13:02:25.964389445\n")
    save(tmp_path / "calib_cam_to_cam.txt", "S_rect_02: 64 48\nP_rect_02: 300 0 32 0 0 300 24 0 0 0 1 0\n")
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "kitti"
    assert [fault.rule for fault in found.faults] == ["files"]
    assert [picture.time is None for picture in found.pictures] == [False, True]
    assert found.pictures[0].camera.fx == 300
    assert found.pictures[0].camera.cx == 32.5


def test_urso_with_fewer_poses_than_images_says_so(tmp_path) -> None:
    image(tmp_path / "0.png")
    image(tmp_path / "1.png")
    save(tmp_path / "train_images.csv", "0.png\n1.png\n")
    save(tmp_path / "train_poses_gt.csv", "x,y,z,q1,q2,q3,q4\n7,1,-2,0,0,0,1\n")
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "urso"
    assert [fault.rule for fault in found.faults] == ["files"]
    assert found.pictures[0].targets[0].t_cam_body.tolist() == [1, 2, 7]


def test_coco_labels_of_no_image_are_said(tmp_path) -> None:
    image(tmp_path / "images" / "a.png")
    note = {"id": 1, "image_id": 9, "category_id": 1, "bbox": [1, 2, 3, 4]}
    document = {"images": [{"id": 1, "file_name": "a.png", "width": 64, "height": 48}], "annotations": [note]}
    save(tmp_path / "annotations" / "train.json", document | {"categories": [{"id": 1, "name": "aqua"}]})
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "coco"
    assert [fault.rule for fault in found.faults] == ["files"]
    assert dict(found.classes) == {"1": "aqua"}


def test_yolo_lines_of_other_lengths_are_said(tmp_path) -> None:
    image(tmp_path / "images" / "train" / "a.png")
    save(tmp_path / "labels" / "train" / "a.txt", "0 0.5 0.5 0.25 0.5\n0 1 2\n0 0.1 0.1 0.1 0.1 0.1\n")
    save(tmp_path / "data.yaml", "train: images/train\nnames: [aqua]\n")
    found, layout, _ = read_set(tmp_path, None)
    assert layout.name == "yolo"
    assert [fault.rule for fault in found.faults] == ["unreadable"] * 2
    target, _ = found.pictures[0].targets
    np.testing.assert_allclose(target.box, [24, 12, 40, 36])
