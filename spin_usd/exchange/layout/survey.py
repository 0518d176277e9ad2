"""A survey of the pictures before anything is written, for the limits and for the dataset's card."""

from array import array
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from msgspec import UNSET

from spin_usd.basics.arrays import Float
from spin_usd.exchange.layout.exported_dataset import ExportedPicture
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.reading.description import DescribedTarget

NONE = float("nan")


def _columns() -> "dict[str, array[float]]":
    return {name: array("d") for name in ("range", "turn", "azimuth", "height", "sun", "visible")}


@dataclass(kw_only=True)
class Survey:
    """Statistics of all pictures; they grow by a few numbers per picture."""

    format: str
    """The name of the format, for sentences."""
    target: str
    """The name of the target that formats of one target hold."""
    parts: int
    """How many the dataset lists."""
    targets: tuple[DescribedTarget, ...]
    """The dataset's."""
    occluders: bool
    """Whether some bodies are no targets."""
    others: int = 0
    """Pictures of which formats of one target would hold another, since `target` is not shown."""
    together: int = 0
    """The most targets that a picture shows."""
    cameras: dict[Camera, str] = field(default_factory=dict)
    """Each camera, with the first picture that has it."""
    file_sets: dict[tuple[str, ...], str] = field(default_factory=dict)
    """Each set of files by kind and ending, with the first picture that has it."""
    farthest: tuple[float, str] = (0.0, "")
    """The greatest z of a target's origin, metres, and its picture."""
    tally: Counter[tuple[str, str]] = field(default_factory=Counter)
    """Pictures by split and variant."""
    kinds: Counter[str] = field(default_factory=Counter)
    """Pictures by the kinds of file that they have."""
    grey: int = 0
    """Pictures whose image has one channel."""
    columns: "dict[str, array[float]]" = field(default_factory=_columns)
    """One number per picture, of its target; NaN without a target. "range" is in metres. "turn" is the angle of the
    rotation from the body's axes to the camera's, degrees. "azimuth" (degrees) and "height" (sine of the elevation)
    give the camera as seen from the target, in the body's axes. "sun" is the angle between the directions from the
    target to the Sun and to the camera, degrees. "visible" is the visible share."""

    @property
    def several(self) -> bool:
        """Return whether a picture shows several bodies, of which one can hide another."""
        return self.together + self.occluders > 1

    def add(self, picture: ExportedPicture) -> None:
        """Count one more picture."""
        target = picture.target
        self.cameras.setdefault(picture.camera, picture.name)
        self.file_sets.setdefault(picture.file_set, picture.name)
        for each in picture.targets:
            self.farthest = max(self.farthest, (float(each.t_cam_body[2]), picture.name))
        self.others += target.name != self.target
        self.together = max(self.together, len(picture.targets))
        self.tally[picture.split, picture.variant] += 1
        self.kinds.update(picture.picture.files.keys())
        self.grey += "image" in picture.picture.files and picture.picture.files["image"].channels == 1
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
