"""LiDAR files: a sensor and its mounting as TOML or JSON, valid by schemas/lidar-1.schema.json."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.basics.resources import bundled
from spin_usd.errors import GeometryError, InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.checked_document import check_document
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.text_file import read_toml_file
from spin_usd.geometry.transform import Transform
from spin_usd.scene.lidar import Lidar

SCHEMA = "lidar-1"
FORWARD, UP = (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)  # of the camera, in its own axes
PARALLEL = 1e-6  # sine of the angle below which two directions span no plane


def read_lidar_file(path: str | Path) -> Lidar:
    """Read the LiDAR in the file at `path`. Raises InputError that names the key or the number that is wrong."""
    path = Path(path)
    read = read_json_file if path.suffix.lower() == ".json" else read_toml_file
    document = read(path, MAX_SPECIFICATION)
    _check(document, path)
    noise = document.get("noise", {})
    given = {
        "noise_constant": noise.get("constant"),
        "noise_proportional": noise.get("proportional"),
        "drop_out": document.get("drop_out"),
        "max_incidence_deg": document.get("max_incidence"),
    }
    try:
        return Lidar(
            T_cam_lidar=_mounting(document.get("mounting", {})),
            pattern=document["pattern"],
            rows=document["rows"],
            columns=document["columns"],
            azimuth_deg=_span(document["azimuth"]),
            elevation_deg=_span(document["elevation"]),
            range_limits=_span(document["range"]),
            **{name: float(value) for name, value in given.items() if value is not None},
        )
    except GeometryError as error:
        raise InputError(error.found, where=path, do="correct it there") from None


def _check(document: Any, path: Path) -> None:
    """Raise InputError where the document breaks the schema, with a file that keeps to it."""
    try:
        check_document(document, SCHEMA, path)
    except InputError as error:
        do = f"compare it with {bundled('lidar', 'flash')}"
        raise InputError(error.found, where=path, do=error.do or do) from None


def _span(numbers: list[float]) -> tuple[float, float]:
    low, high = numbers
    return float(low), float(high)


def _mounting(given: Mapping[str, Any]) -> Transform:
    """Return T_cam_lidar. Raises GeometryError for directions that do not determine its attitude."""
    forward, up = (np.array(given.get(name, usual), float) for name, usual in (("forward", FORWARD), ("up", UP)))
    left = np.cross(up, forward)
    if not np.linalg.norm(left) > PARALLEL * np.linalg.norm(up) * np.linalg.norm(forward):
        raise GeometryError("mounting: forward and up are the same direction, or have no length")
    forward, left = _unit(forward), _unit(left)
    axes = np.stack([forward, left, np.cross(forward, left)], -1)
    position = np.array(given.get("position", (0, 0, 0)), float)
    return Transform(to="cam", of="lidar", rotation=axes, translation=position)


def _unit(vector: Float) -> Float:
    return np.asarray(vector / np.linalg.norm(vector))
