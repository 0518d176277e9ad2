"""A format of calibrations: the contents of its files in their own pixel convention, and our camera from them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera

DEFAULT_PITCH = 5.86e-6  # metres: the Sony IMX174 behind SPEED, SPEED+ and SHIRT
CENTRE, CORNER = 0.0, 0.5
"""Where the first pixel has its centre: at (0, 0), as OpenCV counts, or half a pixel from the corner, as here."""


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The camera of a file, before it is one of ours."""

    size: tuple[int, int]
    """Width and height, pixels."""
    projection: tuple[float, float, float, float]
    """fx, fy, cx, cy in the file's pixels."""
    distortion: tuple[float, ...]
    pixel_pitch: float = DEFAULT_PITCH
    """Metres."""
    notes: tuple[str, ...] = ()
    """Sentences that go on after the file's name."""


@dataclass(frozen=True, kw_only=True)
class CameraFile:
    """A camera as a file gives it."""

    camera: Camera
    pixel_pitch: float
    """The width of a pixel, metres."""
    source: str
    """The file."""
    notes: tuple[str, ...] = ()
    """Notes for the user on how it was read."""


@dataclass(frozen=True, kw_only=True)
class CameraFormat:
    """A format of calibrations."""

    name: str
    """For messages."""
    first_centre: float
    """CENTRE or CORNER."""
    recognises: Callable[[Path, str], bool]
    """Whether a file is of it, from its path and its first characters."""
    read: Callable[[Path], Calibration]
    """Gives the file's camera; raises InputError."""


def named(said: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Return the values found under the names, in any case, with or without "_", in their order, by the file's own
    names."""
    plain = {key: key.lower().replace("_", "") for key in said}
    return {key: said[key] for name in names for key in said if plain[key] == name}


def said_once(said: Mapping[str, Any], names: Sequence[str], path: Path) -> Any:
    """Return the numbers under one of the names, None if missing. Raises InputError if two names have different
    numbers."""
    found = {key: value for key, value in named(said, names).items() if not isinstance(value, str)}
    for one, other in pairwise(found):
        if _flat(found[one]) != _flat(found[other]):
            do = "leave one of them out"
            raise InputError(f"has {one!r} and {other!r}, which differ", where=path, do=do)
    return next(iter(found.values()), None)


def numbers_of(value: Any, counts: Sequence[int], name: str, path: Path) -> list[float]:
    """Return the numbers of a list, of rows, or of OpenCV's matrix, as many as `counts` allow and as the matrix has
    places. Raises InputError."""
    flat = _flat(value)
    if not isinstance(flat, list) or len(flat) not in counts or not all(type(v) in (int, float) for v in flat):
        found = "has no" if value is None else "does not give as numbers the"
        raise InputError(f"{found} {name}", where=path, do="see docs/how-to/own-camera.md for the supported files")
    rows, cols = (value.get(side) if isinstance(value, dict) else None for side in ("rows", "cols"))
    if flat and isinstance(rows, int | float) and isinstance(cols, int | float) and rows * cols != len(flat):
        found = f"gives {len(flat)} numbers as a matrix of {rows:g} x {cols:g}, the {name}"
        raise InputError(found, where=path, do="correct its rows and cols, or its data")
    return [float(each) for each in flat]


def _flat(value: Any) -> Any:
    flat = value.get("data") if isinstance(value, dict) else value
    if isinstance(flat, list) and all(isinstance(row, list) for row in flat):
        return [each for row in flat for each in row]
    return flat


def whole(numbers: Sequence[float], path: Path) -> tuple[int, int]:
    """Return a width and a height in pixels. Raises InputError."""
    if not all(abs(each) < 1e9 and each == int(each) for each in numbers):
        raise InputError(f"has a size of {numbers[0]:g} x {numbers[1]:g}", where=path, do="give whole pixels")
    return int(numbers[0]), int(numbers[1])
