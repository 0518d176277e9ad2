"""A picture as the same camera would take it without lens distortion."""

from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float, frozen
from spin_usd.dataset.export.layout.exported_picture import ExportedPicture
from spin_usd.dataset.export.rectified.resampling import Resampling, resampling
from spin_usd.dataset.read.description import DescribedTarget
from spin_usd.dataset.read.pictured_target import PicturedTarget
from spin_usd.geometry.camera import Camera
from spin_usd.scene.mesh import BOX

OUTSIDE = "outside"


class RectifiedPicture(ExportedPicture):
    """The picture resampled: its image interpolated, its labels looked up in the nearest pixel.

    What its targets say of pixels is said anew. Points are projected exactly; one in the frame is as visible as it was,
    for the ray to it is the same. The box of the projected surface is not known, so it is NaN; whether a target is
    truncated, and which share of it is visible, stay as they were with distortion.
    """

    @classmethod
    def of(cls, picture: ExportedPicture) -> "RectifiedPicture":
        """Return it for a picture with distortion or without."""
        return cls(**{field.name: getattr(picture, field.name) for field in fields(picture)})

    @property
    def camera(self) -> Camera:
        """The camera without distortion."""
        return self._resampling.pinhole

    @property
    def image(self) -> NDArray[Any]:
        """The image, (H, W) or (H, W, 3), 8 or 16 bits, interpolated."""
        return self._resampling.interpolated(super().image)

    def label(self, kind: str) -> NDArray[Any]:
        """Return the label of that name, each pixel that of the nearest. Raises InputError where the picture has
        none."""
        return self._resampling.nearest(super().label(kind))

    def linkable(self, kind: str, suffix: str) -> bool:
        """Return False: no file of the dataset has what is exported."""
        return False

    def mask(self, target: int | None = None) -> NDArray[np.bool_]:
        """Return (H, W): the pixels in which the target with that id, or else `target`, is visible."""
        return self._resampling.nearest(super().mask(target))

    @cached_property
    def targets(self) -> tuple[PicturedTarget, ...]:
        """All targets in order of their ids."""
        described = self.picture.description.targets
        return tuple(map(self._rectified, self.picture.targets, described))

    @property
    def _resampling(self) -> Resampling:
        return resampling(self.picture.camera)

    def _rectified(self, target: PicturedTarget, described: DescribedTarget) -> PicturedTarget:
        mask = self.mask(target.id)
        keypoints = self._projected(target, described.keypoints.points)
        size = (self.camera.width, self.camera.height)
        states = zip(target.keypoint_states, keypoints, strict=True)
        return replace(
            target,
            box_visible=frozen(_box(mask)),
            box_amodal=frozen(np.full(4, np.nan)),
            pixels_visible=int(mask.sum()),
            pixels_amodal=int(self.amodal_mask(target.id).sum()),
            box_3d=self._projected(target, np.where(BOX, described.box[1], described.box[0])),
            keypoints=keypoints,
            keypoint_states=tuple(OUTSIDE if _left(pixel, size) else state for state, pixel in states),
        )

    def _projected(self, target: PicturedTarget, points: Float) -> Float:
        """Return the pixels (N, 2) of points (N, 3) in the target's axes."""
        return frozen(self.camera.project(points @ target.T_cam_body[:3, :3].T + target.T_cam_body[:3, 3]))


def _box(mask: NDArray[np.bool_]) -> Float:
    """Return x0, y0, x1, y1 around the mask (H, W), (0, 0) being the corner of the image; NaN where it is empty."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    ends = [columns[0], rows[0], columns[-1] + 1, rows[-1] + 1] if len(rows) else [np.nan] * 4
    return np.array(ends, np.float64)


def _left(pixel: Float, size: tuple[int, int]) -> bool:
    """Return whether the pixel (2,) lies outside an image of that size; False where there is none."""
    return bool(((pixel < 0) | (pixel >= size)).any())
