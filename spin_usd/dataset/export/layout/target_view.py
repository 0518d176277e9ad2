"""What a picture shows of one target."""

from dataclasses import dataclass

import numpy as np

from spin_usd.arrays import Float, frozen
from spin_usd.dataset.read.picture import Picture
from spin_usd.dataset.read.pictured_target import PicturedTarget

SEGMENTATION = "segmentation"


@dataclass(frozen=True, kw_only=True, eq=False)
class TargetView:
    """A target in a picture.

    id, name: the dataset's · q_cam_body (4,) scalar first, t_cam_body (3,) metres · box_visible (4,): x0, y0, x1, y1
    around its visible pixels, (0, 0) being the corner of the image, so x1 and y1 are past the last pixel; NaN where
    none is visible · pixels_visible: how many are; None where the picture has no segmentation · visible_fraction: their
    share of the whole silhouette; NaN where that is not known.
    """

    id: int
    name: str
    q_cam_body: Float
    t_cam_body: Float
    box_visible: Float
    pixels_visible: int | None
    visible_fraction: float


def targets_in(picture: Picture) -> tuple[TargetView, ...]:
    """Return the targets of the picture in order of their ids."""
    return tuple(_view(picture, target) for target in picture.targets)


def _view(picture: Picture, target: PicturedTarget) -> TargetView:
    box, pixels = np.full(4, np.nan), None
    if SEGMENTATION in picture.files:
        seen = picture.mask(target.id)
        pixels = int(seen.sum())
        rows, columns = np.flatnonzero(seen.any(1)), np.flatnonzero(seen.any(0))
        if pixels:
            box = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], np.float64)
    return TargetView(
        id=target.id,
        name=target.name,
        q_cam_body=target.q_cam_body,
        t_cam_body=target.t_cam_body,
        box_visible=frozen(box),
        pixels_visible=pixels,
        visible_fraction=float("nan"),
    )
