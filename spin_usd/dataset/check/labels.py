"""Rule: each label is of the picture's size, and agrees with the others as its own file in `labels` says."""

from collections.abc import Iterator

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
    camera, pose = picture.record["camera"], picture.record["pose"]
    return LabelledPicture(
        camera=Camera(**{**camera, "distortion": tuple(camera["distortion"])}),
        T_cam_body=Transform.from_quaternion(to="cam", of="body", q=pose["q_cam_body"], t=pose["t_cam_body"]),
        parts=len(picture.inventory.description["parts"]),
        arrays={kind: array for kind, array in picture.arrays.items() if kind in LABELS},
    )
