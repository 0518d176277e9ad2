"""A picture's labels side by side, as `check` compares them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.scene.lidar import Lidar


@dataclass(frozen=True, kw_only=True)
class LabelFault:
    """A fault of a picture's labels: a short code, and a sentence."""

    code: str
    message: str


@dataclass(frozen=True, kw_only=True, eq=False)
class OtherView:
    """Another view of a picture's scene: its camera, and T_cam_body of each target, by id."""

    camera: Camera
    poses: Mapping[int, Transform]


@dataclass(frozen=True, kw_only=True, eq=False)
class LabelledPicture:
    """The labels of one picture, and its record's camera, poses and parts."""

    camera: Camera
    """Its intrinsics."""
    poses: Mapping[int, Transform]
    """T_cam_body of each target, by id."""
    target_of_part: NDArray[np.uint16]
    """(P + 1,): the target of each part that the dataset lists. It is 0 for parts of occluders, and for part 0, which
    is nothing."""
    arrays: Mapping[str, NDArray[Any]]
    """Each label that the picture has, by name: (H, W) or (H, W, C), or (N,) of a LiDAR's points."""
    class_of_part: NDArray[np.uint16]
    """(P + 1,): class ids likewise."""
    boxes: Mapping[int, Float]
    """(2, 3) of each target, body axes, metres."""
    towards_sun: Float | None = None
    """(3,): unit, camera axes; None if the record has no Sun."""
    next_frame: OtherView | None = None
    """The view in the record; None if it has none."""
    paired: OtherView | None = None
    """The view of the paired camera, likewise."""
    lidar: Lidar | None = None
    """The LiDAR, where the picture has its points."""

    @property
    def parts(self) -> int:
        """How many parts the dataset lists."""
        return len(self.target_of_part) - 1

    @cached_property
    def target_ids(self) -> NDArray[np.uint16] | None:
        """(H, W) the target that each pixel shows, 0 for none: from the label `instance` if there is one, else from the
        segmentation; None without both."""
        parts = self.arrays.get("segmentation")
        if "instance" in self.arrays or parts is None:
            return self.arrays.get("instance")
        return np.asarray(np.minimum(parts, 1), np.uint16)

    @cached_property
    def target_pixels(self) -> tuple[NDArray[np.intp], NDArray[np.intp]] | None:
        """Rows (N,) and columns (N,) of the pixels that show a target; None without such a label."""
        if self.target_ids is None:
            return None
        rows, columns = np.nonzero(self.target_ids)
        return rows, columns

    @cached_property
    def points_cam(self) -> Float | None:
        """The dense pose's points (N, 3) at `target_pixels`, in the camera's axes, metres; None without one of both
        labels."""
        return self.points_in(self.poses)

    def points_in(self, poses: Mapping[int, Transform]) -> Float | None:
        """Return the same with the targets in these `poses`; NaN where they have none."""
        dense = self.arrays.get("dense_pose")
        if dense is None or self.target_pixels is None or self.target_ids is None:
            return None
        ids, points = self.target_ids[self.target_pixels], dense[self.target_pixels].astype(np.float64)
        placed = np.full(points.shape, np.nan)
        for number, T_cam_body in poses.items():
            placed[ids == number] = T_cam_body.points(points[ids == number])
        return placed

    @cached_property
    def rounding(self) -> Float:
        """(N,) metres by which float32 may have moved the points in `points_cam`;
        near the camera that is much of their range."""
        points = self.arrays["dense_pose"][self.target_pixels]
        return np.asarray(np.finfo(np.float32).eps * np.linalg.norm(points, axis=-1), np.float64)


def largest_relative_difference(values: NDArray[Any], expected: Float, rounding: Float | float = 0.0) -> float:
    """Return the largest |value - expected| / |expected| of two arrays (N,), less the `rounding`; 0 if they are
    empty."""
    return float(((np.abs(values - expected) - rounding) / np.abs(expected)).max(initial=0))
