"""A picture's labels side by side, as `check` compares them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform


@dataclass(frozen=True, kw_only=True)
class LabelFault:
    """Something wrong with a picture's labels: a short code, and a sentence that says what."""

    code: str
    message: str


@dataclass(frozen=True, kw_only=True, eq=False)
class LabelledPicture:
    """The labels of one picture, and what its record says of camera, pose and parts.

    camera: its intrinsics · T_cam_body: the target's pose · parts: how many parts the dataset lists · arrays: each
    label that the picture has, by name, (H, W) or (H, W, C).
    """

    camera: Camera
    T_cam_body: Transform
    parts: int
    arrays: Mapping[str, NDArray[Any]]

    @cached_property
    def target_pixels(self) -> tuple[NDArray[np.intp], NDArray[np.intp]] | None:
        """Rows (N,) and columns (N,) of the pixels that show a part; None without a segmentation."""
        ids = self.arrays.get("segmentation")
        if ids is None:
            return None
        rows, columns = np.nonzero(ids)
        return rows, columns

    @cached_property
    def points_cam(self) -> Float | None:
        """The dense pose's points (N, 3) at `target_pixels`, in the camera's axes, metres; None without one of both
        labels."""
        dense = self.arrays.get("dense_pose")
        if dense is None or self.target_pixels is None:
            return None
        return self.T_cam_body.points(dense[self.target_pixels])


def largest_relative_difference(values: NDArray[Any], expected: Float) -> float:
    """Return the largest |value - expected| / |expected| of two arrays (N,); 0 where they are empty."""
    return float((np.abs(values - expected) / np.abs(expected)).max(initial=0))
