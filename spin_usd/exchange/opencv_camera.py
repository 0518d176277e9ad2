"""Calibrations as OpenCV's FileStorage has them, as YAML or JSON; ROS's camera_info; Kalibr's chains and EuRoC's
sensor.yaml.

All count pixels from the first one's centre. OpenCV has no names of its own for what a file holds: these are those of
its samples, its documentation and its users, in any case. Kalibr has a chain of cameras, of which the first counts.

Source: OpenCV's sample camera_calibration.cpp; ROS's sensor_msgs/CameraInfo and camera_calibration_parsers; Kalibr's
wiki ("Yaml formats").
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.exchange.camera_format import (
    CENTRE,
    Calibration,
    CameraFormat,
    first_of,
    numbers_of,
    whole,
)
from spin_usd.formats.lens_models import FISHEYES, distortion_of
from spin_usd.formats.yaml_file import read_yaml_file

MATRIX = ("cameramatrix", "k", "intrinsicmatrix", "intrinsicsmatrix", "mtx", "matrix", "newcameramatrix")
COEFFICIENTS = ("distortioncoefficients", "distortioncoeffs", "distcoeffs", "distcoeff", "dist", "d", "distortion")
COEFFICIENTS_ARE = "distortion coefficients (distortion_coefficients)"
WIDTH, HEIGHT = ("imagewidth", "width", "imgwidth", "w"), ("imageheight", "height", "imgheight", "h")
SIZE = ("resolution", "imagesize", "size", "imgsize")
MODEL = ("distortionmodel", "cameramodel", "model", "distortiontype")


def _read(path: Path, *, chain: bool) -> Calibration:
    said, notes = read_yaml_file(path), tuple[str, ...]()
    if chain and (cameras := [key for key, value in said.items() if key.startswith("cam") and isinstance(value, dict)]):
        said = said[cameras[0]]
        if len(cameras) > 1:
            notes = (f"holds {len(cameras)} cameras, and {cameras[0]} is taken: leave another alone to take that",)
    size = first_of(said, SIZE)
    size = [first_of(said, WIDTH), first_of(said, HEIGHT)] if size is None else size
    if size == [None, None]:
        raise InputError("has no image size", where=path, do="add image_width and image_height, in pixels")
    if first_of(said, COEFFICIENTS) is None:
        notes += (f"has no {COEFFICIENTS_ARE}: its lens is taken for one without distortion",)
    return Calibration(
        size=whole(numbers_of(size, [2], "image size", path), path),
        projection=_intrinsics(said, path) if chain else _matrix(said, path),
        distortion=_distortion(said, path),
        notes=notes,
    )


def _intrinsics(said: dict[str, Any], path: Path) -> tuple[float, float, float, float]:
    if (model := said.get("camera_model", "pinhole")) != "pinhole":
        do = "calibrate it as pinhole, with radtan or equidistant distortion"
        raise InputError(f"is of the camera model {model!r}, which cannot be rendered", where=path, do=do)
    fx, fy, cx, cy = numbers_of(said.get("intrinsics"), [4], "intrinsics fx, fy, cx, cy", path)
    return fx, fy, cx, cy


def _matrix(said: dict[str, Any], path: Path) -> tuple[float, float, float, float]:
    k = numbers_of(first_of(said, MATRIX), [9], "camera matrix of nine numbers (camera_matrix)", path)
    if k[1] or k[3] or k[6:] != [0, 0, 1]:
        do = "calibrate without skew"
        raise InputError(f"has the camera matrix {k}, with skew or another last row", where=path, do=do)
    return k[0], k[4], k[2], k[5]


def _distortion(said: dict[str, Any], path: Path) -> tuple[float, ...]:
    found, model = first_of(said, COEFFICIENTS), first_of(said, MODEL)
    fisheye = first_of(said, ("fisheyemodel", "fisheye"))
    model = said.get("distortion_model", model) or ""
    if str(model).lower() == "pinhole":
        model = ""  # of Kalibr's a fisheye is called so too: it says nothing of the distortion
    if fisheye not in (None, 0.0, 0, False, "false"):
        if model and str(model).lower() not in FISHEYES:
            do = "leave one of them out"
            raise InputError(f"says that it is a fisheye, and of the model {model!r}", where=path, do=do)
        model = FISHEYES[0]
    k = [] if found is None else numbers_of(found, range(15), COEFFICIENTS_ARE, path)
    return distortion_of(k, str(model), path, ambiguous=fisheye is None)


def _has(*words: str) -> Callable[[Path, str], bool]:
    return lambda path, head: all(word in head.lower() for word in words)


KALIBR_CAMERA = CameraFormat(
    name="Kalibr", first_centre=CENTRE, recognises=_has("intrinsics:", "resolution:"), read=partial(_read, chain=True)
)
ROS_CAMERA = CameraFormat(
    name="ROS camera_info", first_centre=CENTRE, recognises=_has("distortion_model:"), read=partial(_read, chain=False)
)
OPENCV_CAMERA = CameraFormat(
    name="OpenCV", first_centre=CENTRE, recognises=lambda path, head: True, read=partial(_read, chain=False)
)
