"""A target of a picture as the rules of `check` see it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.commands.check.in_child.checked_picture import CheckedPicture
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.labels.table import CLOUD_LABELS
from spin_usd.records.descriptions import TargetEntry
from spin_usd.records.record import RecordedTarget
from spin_usd.scene.finding import Finding


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedTarget:
    """A target that the record lists."""

    picture: CheckedPicture
    """The picture that it is in."""
    recorded: RecordedTarget
    """The target's entry in the record."""
    described: TargetEntry
    """The target's entry in dataset.json."""
    camera: Camera
    """Camera of the record."""
    T_cam_body: Transform
    """Pose of the record."""
    mask: NDArray[np.bool_] | None
    """(H, W): the pixels that show it; None without such a label."""

    def finding(self, code: str, message: str) -> Finding:
        """Return an error on this target."""
        several = len(self.picture.record.targets) > 1
        named = f"target {self.recorded.id} ({self.recorded.name}): {message}" if several else message
        return Finding(code=code, where=self.picture.where, message=named)

    @property
    def rigid(self) -> bool:
        """Return whether its keypoints are known: its shape matches dataset.json, or its record has them."""
        return self.recorded.true_keypoints is not None or bool(
            np.array_equal(self.recorded.box_3d.box, self.described.box)
        )

    @property
    def keypoints(self) -> Float:
        """(N, 3) in its own axes, metres, as dataset.json has them, or its record; NaN for missing ones."""
        drawn = np.reshape(list(self.described.keypoints.values()), (-1, 3))
        return drawn if (true := self.recorded.true_keypoints) is None else true

    @property
    def dense_pose(self) -> tuple[Float, Float] | None:
        """Points (N, 3), its own axes, metres, of the pixels that show it, and the centres (N, 2) of these pixels; None
        without the labels for it."""
        dense = self.picture.arrays.get("dense_pose")
        if dense is None or self.mask is None:
            return None
        rows, columns = np.nonzero(self.mask)
        return dense[rows, columns].astype(np.float64), np.stack([columns + 0.5, rows + 0.5], -1)


def targets_of(picture: CheckedPicture) -> Iterator[CheckedTarget]:
    """Yield the targets of a picture; none where its files are not of the camera's size, for which there is a rule, or
    where dataset.json does not list them."""
    camera = picture.record.camera.camera
    if any(array.shape[:2] != camera.frame.shape for array in _pixels(picture)):
        return
    described = {target.id: target for target in picture.description.targets}
    for recorded in picture.record.targets:
        if recorded.id in described:
            yield CheckedTarget(
                picture=picture,
                recorded=recorded,
                described=described[recorded.id],
                camera=camera,
                T_cam_body=recorded.pose.T_cam_body,
                mask=_mask(picture, recorded.id),
            )


def _pixels(picture: CheckedPicture) -> Iterator[NDArray[Any]]:
    """Yield the files that have pixels."""
    yield from (array for kind, array in picture.arrays.items() if kind not in CLOUD_LABELS)


def _mask(picture: CheckedPicture, target: int) -> NDArray[np.bool_] | None:
    if "instance" in picture.arrays:
        return np.asarray(picture.arrays["instance"] == target)
    parts = picture.arrays.get("segmentation")
    if parts is None:
        return None
    own = [int(number) for number, part in picture.description.parts.items() if part.target == target]
    return np.isin(parts, own)
