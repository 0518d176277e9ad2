"""camera.json of SPEED, SPEED+, SHIRT and SPEED-UE-Cube: JSON in, Camera out, and back.

`cameraMatrix` and `distCoeffs` (k1, k2, p1, p2, k3) are the calibration. `fx`, `fy` there are the nominal focal length
in metres, `ppx`, `ppy` the pixel pitch in metres; they decide only where a file has no cameraMatrix (SPEED).
Source: reference loaders of the sets, JotaBravo/spacecraft-uda.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.errors import GeometryError, InputError
from spin_usd.exchange.cameras.camera_format import DEFAULT_PITCH, CameraFile
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.lens_models import distortion_of
from spin_usd.geometry.camera import Camera

PITCH_RANGE = (1e-7, 1e-3)  # metres; outside it the number is in another unit


def read_camera_file(path: str | Path) -> CameraFile:
    """Read the camera of the file at `path`. Raises InputError that names the file and the key."""
    path = Path(path)
    document = read_json_file(path, MAX_SPECIFICATION)
    if not isinstance(document, dict):
        raise InputError("is not a camera file: it holds no JSON object", where=path)
    width, height = (_size(document, key, path) for key in ("Nu", "Nv"))
    pitch = _pitch(document, "ppx", path)
    fx, fy, cx, cy = _calibration(document, path) if "cameraMatrix" in document else _nominal(document, path)
    try:
        camera = Camera(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy, distortion=_distortion(document, path))
        camera.check_invertible()
    except GeometryError as error:
        raise InputError(error.found, where=path, do=error.do) from None
    notes = tuple(f"{path.name} {note}" for note in _notes(document))
    return CameraFile(camera=camera, pixel_pitch=pitch, source=str(path), notes=notes)


def camera_document(camera: Camera, *, pitch: float = DEFAULT_PITCH) -> dict[str, Any]:
    """Return the JSON of a camera file, in all digits; `pitch` is the width and height of a pixel, metres.

    Here fx and fy, in metres, agree with cameraMatrix; SPEED+'s own are the nominal 17.6 mm.
    """
    return {
        "Nu": camera.width,
        "Nv": camera.height,
        "ppx": pitch,
        "ppy": pitch,
        "fx": camera.fx * pitch,
        "fy": camera.fy * pitch,
        "ccx": camera.cx,
        "ccy": camera.cy,
        "cameraMatrix": camera.matrix.tolist(),
        "distCoeffs": list(camera.distortion),
    }


def _notes(document: dict[str, Any]) -> Iterator[str]:
    """Yield the ways in which the file differs from a calibration of its pictures, each as the end of a sentence."""
    if "distCoeffs" not in document:
        yield "has no 'distCoeffs': its lens is taken for one without distortion"
    elif len(_listed(document["distCoeffs"])) == 4 and "distortion_model" not in document:
        yield "has four 'distCoeffs', k1, k2, p1 and p2: k3 is taken for 0"


def _calibration(document: dict[str, Any], path: Path) -> tuple[float, float, float, float]:
    """fx, fy, cx, cy in pixels from cameraMatrix."""
    rows = document["cameraMatrix"]
    if not isinstance(rows, list) or len(rows) != 3:
        raise InputError("'cameraMatrix' is not three rows of three numbers", where=path)
    k = np.array([_numbers(row, 3, f"row {i} of 'cameraMatrix'", path) for i, row in enumerate(rows)])
    if k[0, 1] != 0 or k[1, 0] != 0:
        raise InputError(f"'cameraMatrix' has skew {k[0, 1]:g}, which is not supported", where=path)
    if k[2].tolist() != [0, 0, 1]:
        raise InputError(f"the last row of 'cameraMatrix' is {k[2].tolist()}, expected [0, 0, 1]", where=path)
    return float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2])


def _nominal(document: dict[str, Any], path: Path) -> tuple[float, float, float, float]:
    """fx, fy, cx, cy in pixels from the nominal focal length and the pitch; the centre unless ccx, ccy are given."""
    focal = [_number(document, key, path) for key in ("fx", "fy")]
    pitch = [_pitch(document, key, path, required=True) for key in ("ppx", "ppy")]
    cx = _number(document, "ccx", path) if "ccx" in document else document["Nu"] / 2
    cy = _number(document, "ccy", path) if "ccy" in document else document["Nv"] / 2
    return focal[0] / pitch[0], focal[1] / pitch[1], cx, cy


def _distortion(document: dict[str, Any], path: Path) -> tuple[float, ...]:
    """k1, k2, p1, p2, k3; OpenCV also writes four coefficients, without k3. With another "distortion_model", the
    coefficients of that lens."""
    values = _listed(document.get("distCoeffs", [0.0] * 5))
    if isinstance(values, list) and (model := document.get("distortion_model")):
        return distortion_of(_numbers(values, len(values), "'distCoeffs'", path), str(model), path)
    if isinstance(values, list) and len(values) not in (4, 5):
        do = "give k1, k2, p1, p2 and k3 in this order, with 0 for missing ones"
        raise InputError(f"'distCoeffs' holds {len(values)} values, expected 5", where=path, do=do)
    if isinstance(values, list) and len(values) == 4:
        values = [*values, 0.0]
    k1, k2, p1, p2, k3 = _numbers(values, 5, "'distCoeffs'", path)
    return k1, k2, p1, p2, k3


def _listed(values: Any) -> Any:
    """Return the row of a matrix of one row, which OpenCV writes."""
    one_row = isinstance(values, list) and len(values) == 1 and isinstance(values[0], list)
    return values[0] if one_row else values


def _size(document: dict[str, Any], key: str, path: Path) -> int:
    value = _number(document, key, path)
    if value != int(value):
        raise InputError(f"'{key}' is {value!r}, expected a whole number of pixels", where=path)
    return int(value)


def _pitch(document: dict[str, Any], key: str, path: Path, *, required: bool = False) -> float:
    if key not in document and not required:
        return DEFAULT_PITCH
    value = _number(document, key, path)
    if not PITCH_RANGE[0] <= value <= PITCH_RANGE[1]:
        raise InputError(f"'{key}' is {value!r}, which is not a pixel pitch in metres", where=path)
    return value


def _number(document: dict[str, Any], key: str, path: Path) -> float:
    if key not in document:
        raise InputError(f"has no '{key}'", where=path, do="give a camera.json as SPEED+ writes it")
    return _numbers([document[key]], 1, f"'{key}'", path)[0]


def _numbers(values: Any, count: int, name: str, path: Path) -> list[float]:
    if not isinstance(values, list) or len(values) != count or not all(type(v) in (int, float) for v in values):
        raise InputError(f"{name} is not {count} number{'s' * (count > 1)}: {str(values)[:80]}", where=path)
    if not all(abs(v) <= 1e300 for v in values):
        raise InputError(f"{name} holds NaN, infinity or an absurd number", where=path)
    return [float(v) for v in values]
