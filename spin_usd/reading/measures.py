"""Measures of every picture besides its record: a table of names, units and formulas."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from msgspec import UNSET

from spin_usd.reading.picture import Picture
from spin_usd.reading.pictured_target import PicturedTarget
from spin_usd.scene.derived.sunlight import phase_angle

MAX_TARGETS = 8  # whose measures the page shows; other targets' are among the values of the record


class Measure(NamedTuple):
    """A number that pictures are chosen and described by."""

    title: str
    """Name for people."""
    unit: str
    """"" where it has none."""
    of: Callable[[Picture, PicturedTarget], float]
    """Gives its value, NaN if undefined."""


MEASURES = {
    "range": Measure("Range", "m", lambda _, target: target.range),
    "visible": Measure("Visible fraction", "", lambda _, target: target.visible_fraction),
    "u": Measure(
        "Target across the frame, from 0 to 1", "", lambda picture, target: _centre(target)[0] / picture.camera.width
    ),
    "v": Measure(
        "Target down the frame, from 0 to 1", "", lambda picture, target: _centre(target)[1] / picture.camera.height
    ),
    "width": Measure("Width of the box", "px", lambda _, target: target.box_visible[2] - target.box_visible[0]),
    "keypoints": Measure(
        "Visible keypoints", "", lambda _, target: sum(state == "visible" for state in target.keypoint_states)
    ),
    "from_x": Measure("Camera along x", "", lambda _, target: _towards_camera(target)[0]),
    "from_y": Measure("Camera along y", "", lambda _, target: _towards_camera(target)[1]),
    "from_z": Measure("Camera along z", "", lambda _, target: _towards_camera(target)[2]),
    "sun": Measure("Sun angle", "deg", lambda picture, target: _sun_angle(picture, target)),
}
"""Of a target. The Sun angle is that between the Sun and the camera, seen from the target: 0 has the Sun behind the
camera. Where the camera is, seen from the target: a unit vector in its axes."""

OF_PICTURE = {
    "brightness": Measure("Brightness", "", lambda picture, _: _tone(picture, "mean")),
    "dark": Measure("Share of dark pixels", "", lambda picture, _: _tone(picture, "dark")),
    "saturated": Measure("Share of saturated pixels", "", lambda picture, _: _tone(picture, "saturated")),
}
"""Of the whole picture: of the target's pixels, as the record's `tones` has them."""


def measured(picture: Picture) -> dict[str, float]:
    """Return the measures of the picture by their columns' names; names for its second target end in "@2"."""
    found = {name: measure.of(picture, picture.targets[0]) for name, measure in OF_PICTURE.items()}
    for place, target in enumerate(picture.targets[:MAX_TARGETS]):
        found |= {column_of(name, place): measure.of(picture, target) for name, measure in MEASURES.items()}
    return {name: float(value) for name, value in found.items()}


def values_of(picture: Picture) -> dict[str, float | int | str]:
    """Return the picture's row of a table by its columns' names: its identity, its files' paths, its pose, and its
    measures; measures of further targets are called NAME.range and so on."""
    found: dict[str, float | int | str] = {
        "frame": picture.frame,
        "variant": picture.variant,
        "index": picture.index,
        **{f"{kind}_path": str(picture.root / file.path) for kind, file in picture.files.items()},
        **dict(zip(("qw", "qx", "qy", "qz"), picture.q_cam_body.tolist(), strict=True)),
        **dict(zip(("x", "y", "z"), picture.t_cam_body.tolist(), strict=True)),
        **{name: float(measure.of(picture, picture.targets[0])) for name, measure in OF_PICTURE.items()},
        **dict(_flat("record.appearance", picture.record.get("appearance", {}))),
    }
    for place, target in enumerate(picture.targets):
        before = f"{target.name}." if place else ""
        found |= {f"{before}{name}": float(measure.of(picture, target)) for name, measure in MEASURES.items()}
    return found


def _flat(path: str, value: Any) -> Iterator[tuple[str, float | str]]:
    """Yield the numbers and texts of a record's part by their paths, as conditions name them."""
    if isinstance(value, Mapping):
        for name, part in value.items():
            yield from _flat(f"{path}.{name}", part)
    elif isinstance(value, list):
        for place, part in enumerate(value):
            yield from _flat(f"{path}[{place}]", part)
    else:
        yield path, value


def described(targets: int) -> Iterator[tuple[str, Measure, int | None]]:
    """Yield the name of each column, its content, and the index of its target, None for the picture."""
    yield from ((name, measure, None) for name, measure in OF_PICTURE.items())
    for place in range(min(targets, MAX_TARGETS)):
        yield from ((column_of(name, place), measure, place) for name, measure in MEASURES.items())


def column_of(name: str, place: int) -> str:
    """Return the name of the column of that measure of the target at that place."""
    return f"{name}@{place + 1}"


def _centre(target: PicturedTarget) -> tuple[float, float]:
    x0, y0, x1, y1 = target.box_visible.tolist()
    return (x0 + x1) / 2, (y0 + y1) / 2


def _towards_camera(target: PicturedTarget) -> list[float]:
    towards = -target.T_cam_body[:3, :3].T @ target.t_cam_body
    direction: list[float] = (towards / max(float(np.linalg.norm(towards)), 1e-30)).tolist()
    return direction


def _sun_angle(picture: Picture, target: PicturedTarget) -> float:
    sun = picture.recorded.sun
    return float("nan") if sun is UNSET else phase_angle(np.array(sun.towards_cam), target.t_cam_body)


def _tone(picture: Picture, name: str) -> float:
    return float(getattr(picture.recorded.tones, name, "nan"))
