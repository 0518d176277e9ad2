"""Rule: each label has the picture's size, and agrees with the others by the checks in its own file in `labels`."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from msgspec import UNSET, UnsetType
from numpy.typing import NDArray

from spin_usd.commands.check.digests import MAKE_AGAIN
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.commands.check.in_child.checked_target import CheckedTarget, targets_of
from spin_usd.geometry.transform import Transform
from spin_usd.labels.labelled_picture import LabelledPicture, OtherView
from spin_usd.labels.table import CLOUD_LABELS, LABELS
from spin_usd.records.record import NextFrame, PairedCamera, PosedTarget, RecordedTarget
from spin_usd.scene.derived.part_classes import class_ids
from spin_usd.scene.finding import Finding

ROUNDING = 1e-9


def label_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield an error for the first file that has another size than the camera; where none has, for each fault of a
    label."""
    shape = (picture.record.camera.height, picture.record.camera.width)
    for kind, array in picture.arrays.items():
        if kind not in CLOUD_LABELS and array.shape[:2] != shape:
            message = f"is {array.shape[:2]}, the camera is {shape}; {MAKE_AGAIN}"
            yield Finding(code="size", where=picture.record.files[kind].path, message=message)
            return
    labelled = _labelled(picture)
    for label in LABELS.values():
        for fault in label.faults(labelled) if label.name in labelled.arrays else ():
            yield Finding(code=fault.code, where=picture.where, message=f"{fault.message}; {MAKE_AGAIN}")


def _labelled(picture: CheckedPicture) -> LabelledPicture:
    record, description = picture.record, picture.description
    parts = description.parts
    ids = class_ids(part.class_ for part in parts.values())
    return LabelledPicture(
        camera=record.camera.camera,
        poses=_poses(record.targets),
        target_of_part=_by_part({number: part.target for number, part in parts.items()}),
        arrays={kind: array for kind, array in picture.arrays.items() if kind in LABELS},
        class_of_part=_by_part({number: ids[part.class_] for number, part in parts.items()}),
        boxes={target.id: np.array(target.box_3d.box) for target in record.targets},
        towards_sun=None if record.sun is UNSET else np.array(record.sun.towards_cam),
        next_frame=_other_view(record.next),
        paired=_other_view(record.paired),
        lidar=None if record.lidar is UNSET else record.lidar.lidar,
    )


def _other_view(recorded: NextFrame | PairedCamera | UnsetType) -> OtherView | None:
    if recorded is UNSET:
        return None
    return OtherView(camera=recorded.camera.camera, poses=_poses(recorded.targets))


def _poses(recorded: Sequence[RecordedTarget] | Sequence[PosedTarget]) -> dict[int, Transform]:
    """Return T_cam_body of each of the targets, by id."""
    return {target.id: target.pose.T_cam_body for target in recorded}


def _by_part(values: Mapping[str, int]) -> NDArray[np.uint16]:
    """Return (P + 1,) the values by the ids of parts; 0 of nothing."""
    found = np.zeros(max(map(int, values), default=0) + 1, np.uint16)
    for number, value in values.items():
        found[int(number)] = value
    return found


def count_findings(picture: CheckedPicture) -> Iterator[Finding]:
    """Yield errors for counts of pixels, and the visible fraction, that do not fit the masks or one another."""
    for target in targets_of(picture):
        for fault in (*_counts(target), *_fraction(target)):
            yield target.finding("pixels", f"{fault}; {MAKE_AGAIN}")


def _counts(target: CheckedTarget) -> Iterator[str]:
    visible, amodal = target.recorded.pixels.visible, target.recorded.pixels.amodal
    if target.mask is not None and int(target.mask.sum()) != visible:
        yield f"{int(target.mask.sum())} pixels show it, and its record counts {visible}"
    if visible > amodal:
        yield f"its record counts {visible} visible pixels of {amodal}"
    alone = all(part.target == target.recorded.id for part in target.picture.description.parts.values())
    if alone and visible < amodal:
        yield f"its record counts {visible} visible pixels of {amodal}, and there is nothing else to hide it"


def _fraction(target: CheckedTarget) -> Iterator[str]:
    """The fraction equals the share of pixels in the frame, or less if some of the target lies outside it."""
    visible, amodal = target.recorded.pixels.visible, target.recorded.pixels.amodal
    fraction, truncated = target.recorded.visible_fraction, target.recorded.box.truncated
    if fraction is None:
        if amodal:
            yield f"it covers {amodal} pixels, and has no visible fraction"
        return
    most = visible / amodal if amodal else 0.0
    if fraction > most + ROUNDING or (not truncated and fraction < most - ROUNDING):
        yield f"its visible fraction is {fraction:.4g}, and {visible} of {amodal} pixels in the frame are {most:.4g}"
