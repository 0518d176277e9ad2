"""A picture as the same camera would take it without lens distortion."""

from dataclasses import fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float, frozen
from spin_usd.dataset.export.layout.exported_picture import ExportedPicture
from spin_usd.dataset.export.rectified.resampling import Resampling, resampling
from spin_usd.dataset.read.pictured_target import PicturedTarget
from spin_usd.geometry.camera import Camera


class RectifiedPicture(ExportedPicture):
    """The picture resampled: its image interpolated, its labels looked up in the nearest pixel.

    What is counted or bounded by pixels is so anew.
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
        return tuple(map(self._rectified, super().targets))

    @property
    def _resampling(self) -> Resampling:
        return resampling(self.picture.camera)

    def _rectified(self, target: PicturedTarget) -> PicturedTarget:
        mask = self.mask(target.id)
        return replace(target, box_visible=frozen(_box(mask)), pixels_visible=int(mask.sum()))


def _box(mask: NDArray[np.bool_]) -> Float:
    """Return x0, y0, x1, y1 around the mask (H, W), (0, 0) being the corner of the image; NaN where it is empty."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    ends = [columns[0], rows[0], columns[-1] + 1, rows[-1] + 1] if len(rows) else [np.nan] * 4
    return np.array(ends, np.float64)
