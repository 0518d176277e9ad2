"""Labels of one picture against those of another pass."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.accuracy.measurement import LabelFigures
from spin_usd.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class LabelImages:
    """The labels of a whole picture, 0 = nothing: depth (H, W), metres; part (H, W), ids; body (H, W, 3), metres."""

    depth: NDArray[Any]
    part: NDArray[Any]
    body: NDArray[Any]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(H, W), where the target is."""
        return np.asarray(self.part > 0)


@dataclass(frozen=True, kw_only=True)
class Viewpoint:
    """The camera and pose of a picture, which decide where a body point appears."""

    camera: Camera
    T_cam_body: Transform


def agreement(
    ours: LabelImages, theirs: LabelImages, sight: Viewpoint, *, frame: str, renderer: str, against: str
) -> LabelFigures:
    """Return the agreement of the labels `ours`, of the pass of `renderer`, with `theirs`, of that of `against`; two
    empty silhouettes agree."""
    union, both = ours.seen | theirs.seen, ours.seen & theirs.seen
    apart = np.abs(ours.depth[both].astype(np.float64) - theirs.depth[both])
    return LabelFigures(
        frame=frame,
        renderer=renderer,
        against=against,
        iou=float(both.sum() / union.sum()) if union.any() else 1.0,
        depth_m=float(apart.max(initial=0.0)),
        reprojection_px=_worst_reprojection(ours, sight),
        part_pixels=int((ours.part[both] != theirs.part[both]).sum()),
    )


def _worst_reprojection(labels: LabelImages, sight: Viewpoint) -> float:
    """Return the largest distance, pixels, of the projection of a pixel's body point from that pixel's centre."""
    rows, columns = np.nonzero(labels.seen)
    body = labels.body[rows, columns].astype(np.float64)
    found: Float = sight.camera.project(sight.T_cam_body.points(body))
    off = found - (np.stack([columns, rows], -1) + 0.5)
    return float(np.hypot(*off.T).max(initial=0.0))
