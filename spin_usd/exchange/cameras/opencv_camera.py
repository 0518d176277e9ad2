"""Calibrations as OpenCV's FileStorage has them, as YAML, JSON or XML; ROS's camera_info and ost.txt; Kalibr's chains,
EuRoC's sensor.yaml, and those of odometry programs.

All count pixels from the first one's centre. OpenCV defines no names for a file's contents: we accept the names in
its samples, its documentation and its users, in any case. Kalibr has a chain of cameras; we read the first.
Source: OpenCV's sample camera_calibration.cpp; ROS's sensor_msgs/CameraInfo and camera_calibration_parsers; Kalibr's
wiki ("Yaml formats").
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.exchange.cameras.camera_format import (
    CENTRE,
    Calibration,
    CameraFormat,
    named,
    numbers_of,
    said_once,
    whole,
)
from spin_usd.exchange.cameras.named_numbers import COUNT, read_names
from spin_usd.formats.lens_models import FISHEYES, distortion_of, is_fisheye

MATRIX = ("cameramatrix", "k", "intrinsicmatrix", "intrinsicsmatrix", "mtx", "matrix")
COEFFICIENTS = ("distortioncoefficients", "distortioncoeffs", "distcoeffs", "distcoeff", "dist", "d", "distortion")
COEFFICIENTS_ARE = "distortion coefficients (distortion_coefficients)"
WIDTH, HEIGHT = ("imagewidth", "width", "imgwidth", "w"), ("imageheight", "height", "imgheight", "h")
SIZE = ("resolution", "imagesize", "size", "imgsize")
MODEL = ("distortionmodel", "cameramodel", "model", "distortiontype", "distortion")
FLAG = ("fisheyemodel", "fisheye")
WORDS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
LEAVE_ONE = "leave one of them out"
CROP = ("x_offset", "y_offset", "width", "height")


def _read(path: Path) -> Calibration:
    said, notes = read_names(path), tuple[str, ...]()
    cameras = [key for key, value in said.items() if isinstance(value, dict) and "intrinsics" in value]
    said, first, count = (said[cameras[0]], cameras[0], len(cameras)) if cameras else (said, "the first", 1)
    if (count := max(count, said.pop(COUNT, 1))) > 1:
        notes = (f"holds {count} cameras, of which {first} is used: keep only another one to use that",)
    projection = _intrinsics(said, path) if "intrinsics" in said else None
    sides = [said_once(said, names, path) for names in (WIDTH, HEIGHT)]
    sizes = {"size": said_once(said, SIZE, path)} if named(said, SIZE) else {}
    sizes |= {"image_size": sides} if sides != [None, None] else {}
    size = said_once(sizes, SIZE, path)
    if size is None:
        raise InputError("has no image size", where=path, do="add image_width and image_height, in pixels")
    if said_once(said, COEFFICIENTS, path) is None:
        notes += (f"has no {COEFFICIENTS_ARE}: its lens is taken for one without distortion",)
    return Calibration(
        size=_uncropped(said, whole(numbers_of(size, [2], "image size", path), path), path),
        projection=projection or _matrix(said, path),
        distortion=_distortion(said, path),
        notes=notes,
    )


def _intrinsics(said: dict[str, Any], path: Path) -> tuple[float, float, float, float]:
    if (model := said.get("camera_model", "pinhole")) != "pinhole":
        do = "calibrate it as pinhole, with radtan or equidistant distortion"
        raise InputError(f"is of the camera model {model!r}, which cannot be rendered", where=path, do=do)
    fx, fy, cx, cy = numbers_of(said.get("intrinsics"), [4], "intrinsics fx, fy, cx, cy", path)
    return fx, fy, cx, cy


def _uncropped(said: dict[str, Any], size: tuple[int, int], path: Path) -> tuple[int, int]:
    """Return the size. Raises InputError if ROS's pictures are a part of the frame, or binned: the matrix does not
    apply to them."""
    binned = {key: value for key, value in named(said, ("binningx", "binningy")).items() if value not in (0, 1)}
    part = said.get("roi") or {}
    part = [part.get(name, 0) for name in CROP] if isinstance(part, dict) else part
    if binned or part not in ([0, 0, 0, 0], [0, 0, *size]):
        found = f"has {', '.join(binned) or 'a roi'}: its pictures and its camera matrix use different pixels"
        do = "give size and matrix as the pictures have them, and leave binning_x, binning_y and roi out"
        raise InputError(found, where=path, do=do)
    return size


def _matrix(said: dict[str, Any], path: Path) -> tuple[float, float, float, float]:
    given = said_once(said, MATRIX, path) or said_once(said, ("newcameramatrix",), path)
    k = numbers_of(given, [9], "camera matrix of nine numbers (camera_matrix)", path)
    if k[1] or k[3] or k[6:] != [0, 0, 1]:
        do = "calibrate without skew"
        raise InputError(f"has the camera matrix {k}, with skew or another last row", where=path, do=do)
    return k[0], k[4], k[2], k[5]


def _distortion(said: dict[str, Any], path: Path) -> tuple[float, ...]:
    given, flags = said_once(said, COEFFICIENTS, path), named(said, FLAG)
    models = {key: str(value) for key, value in named(said, MODEL).items() if not isinstance(value, list | dict)}
    # Kalibr's fisheye is called a pinhole too: the name does not tell the distortion
    models = {key: value for key, value in models.items() if value.lower() not in ("", "none", "pinhole")}
    fisheye = {key: _is_true(key, value, path) for key, value in flags.items()}
    kinds = fisheye | {key: kind for key, value in models.items() if (kind := is_fisheye(value)) is not None}
    if len({*kinds.values()}) > 1:
        words = " and ".join(f"{key}: {said[key]}" for key in kinds)
        raise InputError(f"contradicts itself about its lens: {words}", where=path, do=LEAVE_ONE)
    model = next(iter(models.values()), FISHEYES[0] if any(fisheye.values()) else "")
    k = [] if given is None else numbers_of(given, range(15), COEFFICIENTS_ARE, path)
    found = distortion_of(k, model, path, ambiguous=not fisheye)
    for key, value in models.items():
        if distortion_of(k, value, path) != found:
            raise InputError(f"contradicts itself about its lens: {model} and {key}: {value}", where=path, do=LEAVE_ONE)
    return found


def _is_true(key: str, value: Any, path: Path) -> bool:
    """Return whether the value is true, or a number other than 0. Raises InputError for other words."""
    if isinstance(value, bool | int | float):
        return bool(value)
    if (word := str(value).lower()) not in WORDS:
        raise InputError(f"has {key}: {value}", where=path, do="write true or false")
    return WORDS[word]


def _has(*words: str) -> Callable[[Path, str], bool]:
    return lambda path, head: all(word in head.lower() for word in words)


def _named(name: str, *words: str) -> CameraFormat:
    return CameraFormat(name=name, first_centre=CENTRE, recognises=_has(*words), read=_read)


OPENCV_CAMERAS = (
    _named("ORB-SLAM", "%yaml", "camera", ".fx:"),
    _named("VINS", "model_type:", "projection_parameters:"),
    _named("SVO", "- camera:", "intrinsics:"),
    _named("SVO", "cam_model:", "cam_width:"),
    _named("basalt", "camera_type", "value0"),
    _named("RealSense", "ppx", "coeffs"),
    _named("Kalibr", "intrinsics:", "resolution:"),
    _named("ROS camera_info", "distortion_model:"),
    _named("ROS ost.txt", "[image]", "camera matrix"),
    _named("OpenCV"),
)
"""Formats in the order in which they are tried; the last takes any file."""
