"""A survey of the pictures before anything is written: what limits ask for, and what the dataset's card tells."""

from array import array
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from msgspec import UNSET

from spin_usd.arrays import Float
from spin_usd.exchange.layout.exported_dataset import ExportedPicture
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.reading.description import DescribedTarget

NONE = float("nan")


def _columns() -> "dict[str, array[float]]":
    return {name: array("d") for name in ("range", "turn", "azimuth", "height", "sun", "visible")}


@dataclass(kw_only=True)
class Survey:
    """What is known of all pictures together; it grows by a few numbers a picture.

    format: the name of the format, for sentences · target: the name of the target that formats of one target hold ·
    parts: how many the dataset lists · targets: the dataset's · bodies: how many have parts, occluders together counted
    as one · cameras: each camera, with the first picture that has it · file_sets: each set of files by kind and ending,
    with the first picture that has it · farthest: the greatest z of a target's origin, metres, and its picture · tally:
    pictures by split and variant · kinds: pictures by the kinds of file that they have.

    columns: of each picture's target (NaN where there is none) its "range" in metres; the angle "turn" of the rotation
    from the body's axes to the camera's, degrees; "azimuth" (degrees) and "height" (sine of the elevation) of the
    camera as seen from it, in the body's axes; the angle "sun" between the directions from it to the Sun and to the
    camera, degrees; and the share "visible" of it.
    """

    format: str
    target: str
    parts: int
    targets: tuple[DescribedTarget, ...]
    bodies: int
    cameras: dict[Camera, str] = field(default_factory=dict)
    file_sets: dict[tuple[str, ...], str] = field(default_factory=dict)
    farthest: tuple[float, str] = (0.0, "")
    tally: Counter[tuple[str, str]] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)
    columns: "dict[str, array[float]]" = field(default_factory=_columns)

    def add(self, picture: ExportedPicture) -> None:
        """Count one more picture."""
        target = picture.target
        self.cameras.setdefault(picture.camera, picture.name)
        self.file_sets.setdefault(picture.file_set, picture.name)
        for each in picture.targets:
            self.farthest = max(self.farthest, (float(each.t_cam_body[2]), picture.name))
        self.tally[picture.split, picture.variant] += 1
        self.kinds.update(picture.picture.files.keys())
        t, rotation = target.t_cam_body, matrix_from_quaternion(target.q_cam_body)
        camera = -rotation.T @ t / max(float(np.linalg.norm(t)), np.finfo(np.float64).tiny)
        row = {
            "range": float(np.linalg.norm(t)),
            "turn": float(np.degrees(2 * np.arccos(min(abs(float(target.q_cam_body[0])), 1.0)))),
            "azimuth": float(np.degrees(np.arctan2(camera[1], camera[0]))),
            "height": float(camera[2]),
            "sun": _sun_angle(picture, t),
            "visible": target.visible_fraction,
        }
        for name, value in row.items():
            self.columns[name].append(value)


def reach(targets: tuple[DescribedTarget, ...]) -> float:
    """Return how far a point of a target is at most from the origin of its axes, metres."""
    return max(float(np.linalg.norm(np.abs(target.box).max(0))) for target in targets)


def _sun_angle(picture: ExportedPicture, t_cam_body: Float) -> float:
    """Return the angle at the target between the Sun and the camera, degrees; NaN where the record has no Sun."""
    sun = picture.picture.recorded.sun
    if sun is UNSET:
        return NONE
    towards_camera = -t_cam_body / np.linalg.norm(t_cam_body)
    return float(np.degrees(np.arccos(np.clip(np.dot(sun.towards_cam, towards_camera), -1, 1))))
