"""Camera files: SPEED+'s own, SPEED's without a matrix, and wrong ones."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from spin_usd.errors import InputError
from spin_usd.exchange.cameras.speed_camera import read_camera_file

PITCH = 5.86e-6
SPEED = {"Nu": 1920, "Nv": 1200, "ppx": PITCH, "ppy": PITCH, "fx": 0.0176, "fy": 0.0176}
SPEEDPLUS = SPEED | {
    "cameraMatrix": [[2988.5795163815555, 0, 960], [0, 2988.3401159176124, 600], [0, 0, 1]],
    "distCoeffs": [-0.22383016606510672, 0.51409797089106379, -0.00066499611998340662, -0.00021404771667484594, -0.13],
}


def matrix(**changed: float) -> list[list[float]]:
    k = {"fx": 2988.0, "skew": 0.0, "cx": 960.0, "fy": 2988.0, "cy": 600.0} | changed
    return [[k["fx"], k["skew"], k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]]


def write(tmp_path: Path, document: Any) -> Path:
    path = tmp_path / "camera.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def test_the_real_file_gives_the_calibration_not_the_nominal_lens(shared: Path) -> None:
    found = read_camera_file(shared / "data" / "speedplus" / "camera.json")
    camera = found.camera
    assert (camera.width, camera.height, camera.cx, camera.cy) == (1920, 1200, 960, 600)
    assert (camera.fx, camera.fy) == (2988.5795163815555, 2988.3401159176124)
    assert camera.distortion[0] == -0.22383016606510672
    assert found.pixel_pitch == PITCH


def test_without_a_matrix_the_nominal_lens_counts(tmp_path: Path) -> None:
    """SPEED: 17.6 mm over 5.86 micrometres, centre of the image, no distortion (datasets' own numbers)."""
    camera = read_camera_file(write(tmp_path, SPEED)).camera
    assert camera.fx == pytest.approx(3003.41, abs=0.005)
    assert (camera.cx, camera.cy, camera.distorted) == (960, 600, False)


def test_opencvs_nested_and_four_coefficient_forms_are_read(tmp_path: Path) -> None:
    for coefficients in ([0.1, 0.2, 0.003, 0.004], [[0.1, 0.2, 0.003, 0.004, 0.0]]):
        camera = read_camera_file(write(tmp_path, SPEEDPLUS | {"distCoeffs": coefficients})).camera
        assert camera.distortion == (0.1, 0.2, 0.003, 0.004, 0.0)


@pytest.mark.parametrize(
    ("document", "found"),
    [
        (SPEEDPLUS | {"cameraMatrix": matrix(fx=0)}, "focal length"),
        (SPEEDPLUS | {"cameraMatrix": matrix(fy=-2988)}, "focal length"),
        (SPEEDPLUS | {"cameraMatrix": matrix(skew=0.5)}, "skew"),
        (SPEEDPLUS | {"cameraMatrix": [[1, 0, 0], [0, 1, 0]]}, "cameraMatrix"),
        (SPEEDPLUS | {"cameraMatrix": [[1, 0, 0], [0, 1], [0, 0, 1]]}, "row 1"),
        (SPEEDPLUS | {"cameraMatrix": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}, "last row"),
        (SPEEDPLUS | {"cameraMatrix": matrix(cx=math.nan)}, "NaN"),
        (SPEEDPLUS | {"Nu": 0}, "width"),
        (SPEEDPLUS | {"Nv": 10**7}, "height"),
        (SPEEDPLUS | {"Nu": 1920.5}, "whole number"),
        (SPEEDPLUS | {"Nu": "1920"}, "Nu"),
        (SPEEDPLUS | {"Nu": True}, "Nu"),
        (SPEEDPLUS | {"distCoeffs": [1, 2]}, "distCoeffs"),
        (SPEEDPLUS | {"distCoeffs": [-0.2, 0.1, 0]}, "holds 3 values, expected 5"),
        (SPEEDPLUS | {"distCoeffs": [-5, 0, 0, 0, 0]}, "cannot be inverted"),
        (SPEEDPLUS | {"ppx": 5.86}, "pixel pitch"),
        ({k: v for k, v in SPEEDPLUS.items() if k != "Nv"}, "'Nv'"),
        ({k: v for k, v in SPEED.items() if k != "ppx"}, "'ppx'"),
        ({k: v for k, v in SPEED.items() if k != "fx"}, "'fx'"),
        (SPEED | {"fx": -0.0176}, "focal length"),
        ([1, 2], "no JSON object"),
        ('{"Nu": 1920', "not JSON"),
    ],
)
def test_bad_cameras_are_refused_in_one_sentence_that_names_the_file(tmp_path: Path, document: Any, found: str) -> None:
    path = write(tmp_path, document)
    with pytest.raises(InputError, match=found) as caught:
        read_camera_file(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_four_coefficients_are_reported(tmp_path: Path) -> None:
    four = read_camera_file(write(tmp_path, SPEEDPLUS | {"distCoeffs": [[-0.2, 0.1, 0, 0]]}))
    assert four.notes == ("camera.json has four 'distCoeffs', k1, k2, p1 and p2: k3 is taken for 0",)
    assert read_camera_file(write(tmp_path, SPEEDPLUS)).notes == ()
