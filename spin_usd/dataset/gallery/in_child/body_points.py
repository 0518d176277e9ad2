"""The dense pose by the depth, the camera and the pose. The page computes it too, so a file need only hold by how much
the dataset's dense pose differs, which is next to nothing."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.dataset.read.picture import INSTANCE, Picture
from spin_usd.geometry.region import Region

STEP_M = 1e-5
"""What points of the dense pose are rounded to on the page: a hundredth of a millimetre."""
MAX_STEPS = 2**20  # 10 m: a dense pose that is further off is kept as it is


def steps_from_depth(picture: Picture, region: Region, labels: Mapping[str, NDArray[Any]]) -> NDArray[np.int32] | None:
    """Return (h, w, 3): by how many steps the dense pose in the `region` differs from `points_of_depth`; None where
    one of the labels that it takes is not there, or they are too far from each other for that."""
    if not {"depth", "dense_pose"} <= set(labels) or not {INSTANCE, "segmentation"} & set(labels):
        return None
    left = labels["dense_pose"][region.slices] - points_of_depth(picture, region, labels)
    steps = np.rint(left / STEP_M)
    return steps.astype(np.int32) if (np.abs(steps) <= MAX_STEPS).all() else None


def points_of_depth(picture: Picture, region: Region, labels: Mapping[str, NDArray[Any]]) -> Float:
    """Return (h, w, 3): the point in the axes of the target seen in each pixel, by the depth, the camera and the pose,
    metres; 0 where no target is."""
    depth = labels["depth"][region.slices].astype(np.float64)
    ids = target_ids(picture, labels)[region.slices]
    rays = np.concatenate([picture.camera.centres(region), np.ones((*region.shape, 1))], -1)
    points = np.zeros((*region.shape, 3))
    for target in picture.targets:
        own = (ids == target.id) & (depth > 0)
        points[own] = (rays[own] * depth[own][:, None] - target.t_cam_body) @ target.T_cam_body[:3, :3]
    return points


def target_ids(picture: Picture, labels: Mapping[str, NDArray[Any]]) -> NDArray[np.uint16]:
    """Return (H, W): the id of the target that each pixel shows, by the instance, or else the part; 0 for none."""
    if INSTANCE in labels:
        return labels[INSTANCE]
    of_part = np.zeros(np.iinfo(np.uint16).max + 1, np.uint16)
    for part in picture.parts.values():
        if part.id < len(of_part):
            of_part[part.id] = part.target
    found: NDArray[np.uint16] = of_part[labels["segmentation"]]
    return found
