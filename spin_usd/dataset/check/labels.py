"""Rule: each label is of the picture's size, and agrees with the others as its own file in `labels` says."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from spin_usd.dataset.check.checked_picture import MAKE_AGAIN, CheckedPicture
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.labels.labelled_picture import LabelledPicture
from spin_usd.labels.table import LABELS
from spin_usd.scene.finding import Finding


def label_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield an error for the first file that has another size than the camera; where none has, for each fault of a
    label."""
    camera = picture.record["camera"]
    shape = (camera["height"], camera["width"])
    for kind, array in picture.arrays.items():
        if array.shape[:2] != shape:
            message = f"is {array.shape[:2]}, the camera is {shape}; {MAKE_AGAIN}"
            yield Finding(code="size", where=picture.record["files"][kind]["path"], message=message)
            return
    labelled = _labelled(picture)
    for label in LABELS.values():
        for fault in label.faults(labelled) if label.name in labelled.arrays else ():
            yield Finding(code=fault.code, where=picture.where, message=f"{fault.message}; {MAKE_AGAIN}")


def _labelled(picture: CheckedPicture) -> LabelledPicture:
    camera, parts = picture.record["camera"], picture.inventory.description["parts"]
    target_of_part = np.zeros(max(map(int, parts), default=0) + 1, np.uint16)
    for number, part in parts.items():
        target_of_part[int(number)] = part["target"]
    return LabelledPicture(
        camera=Camera(**{**camera, "distortion": tuple(camera["distortion"])}),
        poses={target["id"]: _pose(target["pose"]) for target in picture.record["targets"]},
        target_of_part=target_of_part,
        arrays={kind: array for kind, array in picture.arrays.items() if kind in LABELS},
    )


def _pose(recorded: Mapping[str, Any]) -> Transform:
    return Transform.from_quaternion(to="cam", of="body", q=recorded["q_cam_body"], t=recorded["t_cam_body"])
