"""URSO: Unreal's axes and UrsoNet's quaternions, against numbers made by hand and UrsoNet's own formulas."""

import csv

import numpy as np
import pytest

from spin_usd.exchange.urso import location, quaternion
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrix_from_quaternion
from tests.exchange.conftest import PLAIN, clone, write_export

# UrsoNet's camera: 1280 x 960, 90 and 73.7 degrees; its K has a negative fy.
FX, FY = 640 / np.tan(np.pi / 4), 480 / np.tan(np.radians(73.7) / 2)
CAMERA = Camera(width=1280, height=960, fx=FX, fy=FY, cx=640, cy=480)


def rotation(q1, q2, q3, q4):
    """The matrix of a JPL quaternion (Trawny and Roumeliotis, 2005): (2 q4^2 - 1) I - 2 q4 [v x] + 2 v v^T."""
    v = np.array([q1, q2, q3])
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return (2 * q4**2 - 1) * np.eye(3) - 2 * q4 * cross + 2 * np.outer(v, v)


def test_a_location_by_hand() -> None:
    """One metre right, two up, ten ahead: u = 640 + 640 / 10, v = 480 - 640.46 * 2 / 10."""
    x, y, z = location(np.array([1.0, -2.0, 10.0]))
    assert (x, y, z) == (10, 1, 2)
    seen = (640 + FX * y / x, 480 - FY * z / x)
    assert seen == pytest.approx((704, 351.908), abs=1e-3)
    assert seen == pytest.approx(CAMERA.project([1, -2, 10]).tolist(), abs=1e-12)


@pytest.mark.parametrize(
    ("q_cam_body", "written"),
    [
        ([1, 0, 0, 0], (0, 0, 0, 1)),
        ([0.5, 0.5, 0.5, 0.5], (0.5, -0.5, 0.5, 0.5)),
        ([0.8, 0, 0.6, 0], (0, -0.6, 0, 0.8)),
    ],
)
def test_quaternions_by_hand(q_cam_body, written) -> None:
    assert quaternion(np.array(q_cam_body, np.float64)) == written


def test_ursonet_projects_a_body_point_to_the_same_pixel() -> None:
    """With its K, of negative fy, its quat2SO3 and its mirrored y of the body."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.normal(size=4)
        q /= np.linalg.norm(q) * (1 if q[0] > 0 else -1)
        t, point = np.array([*rng.uniform(-2, 2, 2), 15.0]), rng.uniform(-1, 1, 3)
        x, y, z = location(t)
        cam = rotation(*quaternion(q)) @ (point * (1, -1, 1)) + (y, z, x)
        k = np.array([[FX, 0, 640], [0, -FY, 480], [0, 0, 1]])
        u, v, w = k @ cam
        expected = CAMERA.project(matrix_from_quaternion(q) @ point + t)
        assert np.abs(np.array([u, v]) / w - expected).max() < 1e-9


def test_files_are_numbered_and_listed(rendered, tmp_path) -> None:
    pictures = [
        {"frame": f"f{number}", "q": [1.0, 0, 0, 0], "t": [1.0, -2.0, 10.0], "camera": PLAIN} for number in (1, 2)
    ]
    pictures[1]["t"] = [0.0, 0.0, 12.0]
    dataset = clone(rendered, tmp_path / "dataset", pictures)
    write_export(dataset, "urso", tmp_path / "out", split="train=0.5,validation=0.5")
    listed = {split: (tmp_path / "out" / f"{split}_images.csv").read_text().split() for split in ("train", "val")}
    assert sorted(name for names in listed.values() for name in names) == ["0_rgb.png", "1_rgb.png"]
    assert all((tmp_path / "out" / name).is_file() for names in listed.values() for name in names)
    for split, (name,) in listed.items():
        with (tmp_path / "out" / f"{split}_poses_gt.csv").open() as file:
            (row,) = csv.DictReader(file)
        expected = (10.0, 1.0, 2.0) if name == "0_rgb.png" else (12.0, 0.0, 0.0)
        assert tuple(float(row[axis]) for axis in "xyz") == expected
        assert [float(row[f"q{number}"]) for number in (1, 2, 3, 4)] == [0, 0, 0, 1]
