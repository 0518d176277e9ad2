"""Calibrations of other programs, with the names of Kalibr and OpenCV: FileStorage's XML, ROS's ost.txt, and those with
a name for each number, as ORB-SLAM, VINS (camodocal), SVO, basalt and RealSense have them.

Source: OpenCV's cv::FileStorage; ROS's camera_calibration_parsers; ORB-SLAM3's Calibration_Tutorial; camodocal's
camera_models; rpg_svo's and rpg_vikit's calibrations; basalt's Calibration.md; librealsense's rs2_intrinsics.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from spin_usd.basics.faults import decoding
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.lens_models import is_fisheye
from spin_usd.formats.text_file import lines_in, read_any_text
from spin_usd.formats.yaml_file import read_yaml_file

COUNT = "number of cameras"
"""Name of a value that is not the file's own."""
PREFIX = re.compile(r"camera\d?\.|cam_")
MODELS = ("camera_type", "model_type", "camera_model", "model", "type")
LENSES = ("distortion_model", "distortion_type")
PROJECTIONS = (("fx", "fy", "cx", "cy"), ("fx", "fy", "ppx", "ppy"), ("mu", "mv", "u0", "v0"), ("gamma1",))
PINHOLE: tuple[str, ...] = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")


def read_names(path: Path) -> dict[str, Any]:
    """Return the contents of the calibration at `path` by the names of Kalibr or OpenCV. Raises InputError."""
    text = read_any_text(path, MAX_SPECIFICATION)
    if text.lstrip().startswith("<"):
        return _of_storage(text, path)
    if re.search(r"(?m)^\[image\]\s*$", text):
        return _of_ini(text, path)
    return _renamed(read_yaml_file(path))


def _of_storage(text: str, path: Path) -> dict[str, Any]:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError("defines entities, which no calibration needs", where=path, do="remove its DOCTYPE")
    with decoding(path):
        root = ElementTree.fromstring(text)
    if root.tag != "opencv_storage":
        found = f"is XML of <{root.tag[:40]}>, not of OpenCV's <opencv_storage>"
        raise InputError(found, where=path, do="see docs/how-to/own-camera.md for the supported files")
    return {
        each.tag: {part.tag: _numbers(part.text or "") for part in each} or _numbers(each.text or "") for each in root
    }


def _of_ini(text: str, path: Path) -> dict[str, Any]:
    found: dict[str, list[str]] = {}
    name = ""
    for line in lines_in(text, path):
        words = line.partition("#")[0].split()
        if words and isinstance(_numbers(words[0]), str):
            name = "_".join(words)
        elif words:
            found.setdefault(name, []).extend(words)
    return {name: _numbers(" ".join(words)) for name, words in found.items()}


def _numbers(text: str) -> Any:
    """Return the numbers of a text, one as such, or the text."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return text.strip().strip('"')
    return numbers[0] if len(numbers) == 1 else numbers


def _renamed(said: dict[str, Any]) -> dict[str, Any]:
    """Return the contents with Kalibr's names, if each number of the projection has a name, or lies deeper."""
    flat: dict[str, Any] = {}
    for key, value in _leaves(said, ""):
        flat.setdefault(key, value)
    given = next((names for names in PROJECTIONS if all(name in flat for name in names)), ())
    if {"camera_matrix", "K", "intrinsics"} & {*said} or not (given or isinstance(flat.get("intrinsics"), dict)):
        return said
    camera = next((_model(flat[name]) for name in MODELS if name in flat), "pinhole")
    lens = next((_model(flat[name]) for name in LENSES if name in flat), camera)
    named = PINHOLE if "d0" not in flat else ("d0", "d1", "d2", "d3", "d4")
    if is_fisheye(lens):
        named = ("k2", "k3", "k4", "k5") if "mu" in flat else ("k1", "k2", "k3", "k4")
    k: Any = [flat.get(name, 0.0) for name in named] if any(name in flat for name in named) else ""
    k = flat.get("coeffs", flat.get("distortion_parameters", k))
    if "brown" in camera.lower() and isinstance(k, list) and not any(k):
        camera = lens = "pinhole"  # in either direction
    return flat | {
        "camera_model": "pinhole" if is_fisheye(camera) is not None else camera,
        "intrinsics": [flat[name] for name in given] or flat["intrinsics"],
        "model": lens,
        "D": k,
        COUNT: flat.get(COUNT, 1 + ("Camera2.fx" in said)),
    }


def _model(value: Any) -> str:
    return str(value).rpartition(".")[2].replace(" ", "_")


def _leaves(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Yield the names and values in tables; of lists by camera those of the first."""
    if isinstance(value, list) and value and isinstance(value[0], list if name == "resolution" else dict):
        yield COUNT, len(value)
        value = value[0]
    if not isinstance(value, dict) or "data" in value:
        yield PREFIX.sub("", name.lower()), value
        return
    for key, each in value.items():
        deeper = name == "distortion" and key in ("type", "parameters")
        yield from _leaves(each, f"distortion_{key}" if deeper else key)
