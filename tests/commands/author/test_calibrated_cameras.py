"""Cameras that OpenCV calibrates on our own pictures, as it writes them: `author` has the camera back."""

import cv2
import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.reading.dataset import Dataset
from spin_usd.stage.author.camera_layer import camera_layer_of

CENTRE_PX, KEYPOINT_PX = 1e-3, 1e-3  # of what OpenCV, which computes with float32 corners, finds
SIZE = (500, 400)
BOARD = "o board\nv -0.6 -0.5 0\nv 0.6 -0.5 0\nv 0.6 0.5 0\nv -0.6 0.5 0\nf 1 2 3 4\n"
NUMBERS = {"width": SIZE[0], "height": SIZE[1], "cx": 253.7, "cy": 197.3}
PINHOLE = Camera(**NUMBERS, fx=410.2, fy=409.3, distortion=(-0.18, 0.06, 8e-4, -5e-4, -0.01))
FISHEYE = Camera(**NUMBERS, fx=215.1, fy=215.6, distortion=Fisheye(0.02, -0.006, 0.003, -0.001))


def poses():
    """Boards in all parts of the picture, tilted."""
    rng, rows = np.random.default_rng(3), ["name,qw,qx,qy,qz,x,y,z"]
    for number in range(24):
        turn = cv2.Rodrigues(np.append(rng.uniform(-0.6, 0.6, 2), 0.3))[0] @ np.diag([1, -1, -1])
        z = rng.uniform(1.2, 2.2)
        place = [rng.uniform(-0.3, 0.3) * z, rng.uniform(-0.2, 0.2) * z, z]
        rows.append(",".join(map(repr, [f"b{number:02}", *_quaternion(turn), *map(float, place)])).replace("'", ""))
    return "\n".join(rows) + "\n"


def _quaternion(matrix):
    vector = cv2.Rodrigues(matrix)[0].ravel()
    angle = np.linalg.norm(vector)
    return [float(np.cos(angle / 2)), *map(float, np.sin(angle / 2) * vector / angle)]


def calibrated(dataset, fisheye):
    """OpenCV's matrix and coefficients, from the points of the board that the label says pixels show."""
    rng, boards, seen = np.random.default_rng(0), [], []
    for picture in dataset:
        rows, columns = np.nonzero(picture.label("segmentation"))
        chosen = rng.choice(len(rows), 150, replace=False)
        points = picture.label("dense_pose")[rows[chosen], columns[chosen]].astype(np.float64)
        points[:, 2] = 0
        boards.append(points[None])
        seen.append(np.stack([columns[chosen], rows[chosen]], -1).astype(np.float64)[None])  # OpenCV's pixels
    if fisheye:
        flags = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_FIX_SKEW | cv2.CALIB_USE_INTRINSIC_GUESS
        start = np.array([[215.0, 0, 250], [0, 215.0, 200], [0, 0, 1]])
        found = cv2.fisheye.calibrate(
            boards, seen, SIZE, start, np.zeros((4, 1)), flags=flags, criteria=(3, 200, 1e-12)
        )
    else:
        points, pixels = ([each.astype(np.float32) for each in every] for every in (boards, seen))
        found = cv2.calibrateCamera(points, pixels, SIZE, None, None)
    return found[1:3]


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE], ids=["pinhole", "fisheye"])
def test_a_board_calibrated_by_opencv_gives_the_camera_back(spin_usd, tmp_path, camera) -> None:
    (tmp_path / "board.obj").write_text(BOARD)
    (tmp_path / "poses.csv").write_text(poses())
    camera_layer_of(camera, pixel_pitch=5e-6, documentation="").Export(str(tmp_path / "camera.usda"))
    given = ("--poses", tmp_path / "poses.csv", "--target", tmp_path / "board.obj", "--units-per-metre", 1)
    spin_usd("author", *given, "--camera", tmp_path / "camera.usda", "--out", tmp_path / "stage")
    labels = ("--labels-only", "--labels", "segmentation,dense_pose")
    spin_usd("render", tmp_path / "stage", "--out", tmp_path / "set", *labels)
    K, D = calibrated(Dataset(tmp_path / "set"), camera.fisheye)
    file = cv2.FileStorage(str(tmp_path / "cv.yaml"), cv2.FILE_STORAGE_WRITE)
    for name, value in {"image_width": SIZE[0], "image_height": SIZE[1], "camera_matrix": K, "D": D}.items():
        file.write(name, value)
    file.write("fisheye_model", int(camera.fisheye))
    file.release()
    made = spin_usd("author", *given, "--camera", tmp_path / "cv.yaml", "--out", tmp_path / "again")
    assert "half a pixel is added" in made.stderr
    spin_usd("render", tmp_path / "again", "--out", tmp_path / "new", *labels)
    picture = Dataset(tmp_path / "new")[0]
    assert picture.camera.cx == pytest.approx(camera.cx, abs=CENTRE_PX)
    assert picture.camera.cy == pytest.approx(camera.cy, abs=CENTRE_PX)
    target = picture.targets[0]
    corners = np.array([[x, y, 0] for x in (-0.6, 0.6) for y in (-0.5, 0.5)])
    project = cv2.fisheye.projectPoints if camera.fisheye else cv2.projectPoints
    theirs = project(corners[:, None], cv2.Rodrigues(picture.T_cam_body[:3, :3])[0], picture.t_cam_body, K, D)[0][:, 0]
    off = np.linalg.norm(target.box_3d[:, None] - (theirs + 0.5), axis=-1).min(1)
    assert off.max() < KEYPOINT_PX
