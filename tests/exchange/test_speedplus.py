"""SPEED, SPEED+ and SHIRT: their field names and folders, and OpenCV's projection of the published keypoints."""

import json

import cv2
import numpy as np
import pytest
from PIL import Image

from spin_usd.exchange.cameras.speed_camera import read_camera_file
from spin_usd.exchange.layout.images import grey
from tests.conftest import speedplus_camera
from tests.exchange.conftest import PLAIN, clone, write_export

# SPEED+: two poses of its lists, the keypoints of Tango (tpark94/speedplusbaseline), and where the published
# calibration puts them in the distorted picture: pixels.
POSES = {
    "img000014": ([0.556984, -0.711815, 0.168095, -0.393487], [-0.423949, -0.14451, 6.509727]),
    "img000001": (
        [-0.152482913371, 0.30159953881, 0.937286943417, 0.085322125029],
        [-0.060311131463, 0.146283907769, 2.697224827913],
    ),
}
POINTS = {
    1: (-0.37, -0.385, 0.3215),
    2: (-0.37, 0.385, 0.3215),
    3: (0.37, 0.385, 0.3215),
    4: (0.37, -0.385, 0.3215),
    5: (-0.37, -0.264, 0),
    6: (-0.37, 0.304, 0),
    7: (0.37, 0.304, 0),
    8: (0.37, -0.264, 0),
    9: (-0.5427, 0.4877, 0.2535),
    10: (0.5427, 0.4877, 0.2591),
    11: (0.305, -0.579, 0.2515),
}
PIXELS = {
    "img000014": {
        1: (739.956, 796.962),
        2: (789.847, 696.757),
        3: (1020.741, 453.641),
        4: (948.973, 574.972),
        5: (639.679, 686.238),
        6: (667.184, 603.906),
        7: (899.552, 368.676),
        8: (855.137, 465.684),
        9: (714.039, 719.113),
        10: (1060.730, 361.671),
        11: (893.933, 600.834),
    },
    "img000001": {1: (856.664, 226.274), 3: (736.594, 1449.687), 9: (1708.502, 993.961), 11: (146.536, 493.548)},
}
ROUNDED = 2e-3  # pixels: the published poses have six decimals, the pixels three


@pytest.fixture(scope="module")
def published(rendered, tmp_path_factory):
    """A dataset whose records have the published poses and calibration."""
    k = speedplus_camera()["cameraMatrix"]
    camera = {
        "fx": k[0][0],
        "fy": k[1][1],
        "cx": k[0][2],
        "cy": k[1][2],
        "distortion": speedplus_camera()["distCoeffs"],
    }
    pictures = [{"frame": name, "q": q, "t": t, "camera": camera} for name, (q, t) in POSES.items()]
    return clone(rendered, tmp_path_factory.mktemp("published") / "dataset", pictures)


@pytest.fixture(scope="module")
def speedplus(published, tmp_path_factory):
    out = tmp_path_factory.mktemp("speedplus") / "out"
    write_export(published, "speedplus", out)
    return out


def test_opencv_projects_to_the_published_pixels(speedplus) -> None:
    """x_cam = R(q) p + r with the list's quaternion, camera.json's matrix and distortion."""
    camera = json.loads((speedplus / "camera.json").read_text())
    entries = {entry["filename"]: entry for entry in json.loads((speedplus / "synthetic" / "train.json").read_text())}
    for name, expected in PIXELS.items():
        entry = entries[f"{name}.jpg"]
        w, *xyz = entry["q_vbs2tango_true"]
        half = np.arctan2(np.linalg.norm(xyz), w)
        vector = 2 * half * np.array(xyz) / np.linalg.norm(xyz)
        points = np.array([POINTS[number] for number in expected])
        matrix, lens = np.array(camera["cameraMatrix"]), np.array(camera["distCoeffs"])
        found, _ = cv2.projectPoints(points, vector, np.array(entry["r_Vo2To_vbs_true"]), matrix, lens)
        assert np.abs(found[:, 0] - list(expected.values())).max() < ROUNDED


def test_numbers_keep_all_digits(speedplus) -> None:
    entries = json.loads((speedplus / "synthetic" / "train.json").read_text())
    for entry in entries:
        q, t = POSES[entry["filename"].removesuffix(".jpg")]
        assert (entry["q_vbs2tango_true"], entry["r_Vo2To_vbs_true"]) == (q, t)


def test_the_camera_file_is_read_back(speedplus) -> None:
    read = read_camera_file(speedplus / "camera.json")
    assert (read.camera.fx, read.camera.cy, read.pixel_pitch) == (2988.5795163815555, 600.0, 5.86e-6)
    assert list(read.camera.distortion) == speedplus_camera()["distCoeffs"]
    document = json.loads((speedplus / "camera.json").read_text())
    assert document["fx"] / document["ppx"] == pytest.approx(document["cameraMatrix"][0][0], rel=1e-15)
    assert set(document) == set(speedplus_camera())


def test_images_are_grey_and_masks_are_the_target(published, speedplus) -> None:
    made = np.asarray(Image.open(speedplus / "synthetic" / "images" / "img000014.jpg"))
    original = np.asarray(Image.open(published / "image" / "nominal" / "img000014.png"))
    assert made.ndim == 2
    assert np.abs(made.astype(int) - original).mean() < 2
    mask = np.asarray(Image.open(speedplus / "synthetic" / "masks" / "img000014.png"))
    parts = np.asarray(Image.open(published / "segmentation" / "nominal" / "img000014.png"))
    assert np.array_equal(mask, np.where(parts > 0, 255, 0))


def test_a_mask_is_found_under_its_images_name(speedplus) -> None:
    """As spnv2's preprocessing looks for it, with OpenCV, which goes by a file's content: without loss."""
    for image in sorted((speedplus / "synthetic" / "images").iterdir()):
        found = cv2.imread(str(speedplus / "synthetic" / "masks" / image.name), cv2.IMREAD_GRAYSCALE)
        mask = cv2.imread(str(speedplus / "synthetic" / "masks" / f"{image.stem}.png"), cv2.IMREAD_GRAYSCALE)
        assert found.any()
        assert np.array_equal(found, mask)


def test_part_masks_and_linked_images(published, tmp_path) -> None:
    write_export(
        published, "speedplus", tmp_path / "out", options={"masks": "parts", "image": "png", "domain": "sunlamp"}
    )
    mask = np.asarray(Image.open(tmp_path / "out" / "sunlamp" / "masks" / "img000014.png"))
    parts = np.asarray(Image.open(published / "segmentation" / "nominal" / "img000014.png"))
    assert mask.dtype == np.uint8
    assert np.array_equal(mask, parts)
    image = tmp_path / "out" / "sunlamp" / "images" / "img000014.png"
    assert image.samefile(published / "image" / "nominal" / "img000014.png")


def test_colours_become_grey_by_hand() -> None:
    """0.2126 R + 0.7152 G + 0.0722 B; of 16 bits the upper eight."""
    image = np.array([[[100, 0, 0], [0, 100, 0], [0, 0, 100], [255, 255, 255]]], np.uint8)
    assert grey(image).tolist() == [[21, 72, 7, 255]]
    assert grey(np.array([[0xABCD]], np.uint16)).tolist() == [[0xAB]]


def test_speed_has_its_own_names(plain, tmp_path) -> None:
    write_export(plain, "speed", tmp_path / "out", split="train=0.67,test=0.33")
    train = json.loads((tmp_path / "out" / "train.json").read_text())
    test = json.loads((tmp_path / "out" / "test.json").read_text())
    assert (len(train), len(test)) == (2, 1)
    assert set(train[0]) == {"filename", "q_vbs2tango", "r_Vo2To_vbs_true"}
    assert (tmp_path / "out" / "images" / "test" / test[0]["filename"]).is_file()
    assert json.loads((tmp_path / "out" / "camera.json").read_text())["distCoeffs"] == [0.0] * 5


def test_shirt_is_a_trajectory_in_its_order(rendered, tmp_path) -> None:
    """Names that do not sort as numbers do: the trajectory goes by the frames' places in the stage."""
    pictures = [{"frame": f"img{number}", "index": number, "camera": PLAIN} for number in (10, 9, 2)]
    dataset = clone(rendered, tmp_path / "dataset", pictures)
    write_export(dataset, "shirt", tmp_path / "out", options={"trajectory": "roe2", "step": "2.5"})
    entries = json.loads((tmp_path / "out" / "roe2" / "roe2.json").read_text())
    assert [entry["filename"] for entry in entries] == ["img2.jpg", "img9.jpg", "img10.jpg"]
    assert all((tmp_path / "out/roe2/synthetic/images" / entry["filename"]).is_file() for entry in entries)
    metadata = json.loads((tmp_path / "out" / "metadata.json").read_text())
    assert metadata["pSim"] == {"cam_step": 2.5, "num_images": 3}
    assert metadata["pMdl"] == {"r_pri2cam_pri": [0, 0, 0], "q_pri2cam": [1, 0, 0, 0]}
