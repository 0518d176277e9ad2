"""How far a model's points are off in predicted poses: ADD and ADD-S, and BOP's MSSD and MSPD with their recalls.

Sources: Hinterstoisser et al. 2012 for ADD and ADD-S; Hodan et al. 2020, "BOP Challenge 2020 on 6D Object
Localization", for MSSD, MSPD and their thresholds. No symmetries are assumed: for MSSD and MSPD a spacecraft has none.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera

if TYPE_CHECKING:
    from scipy.spatial import KDTree

NEAR = 0.1  # of the diameter: what ADD counts as found
SHARES = np.arange(1, 11) * 0.05  # of the diameter: thresholds of MSSD
PIXELS = np.arange(1, 11) * 5.0  # of a picture 640 pixels wide: thresholds of MSPD
BOP_WIDTH = 640


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelErrors:
    """Errors of N poses by the points of a model, (N,) each; metres, but for `mspd`, pixels."""

    add: Float
    """The mean distance between a point where it is and where it was predicted."""
    add_s: Float
    """The mean distance from each true point to the nearest predicted one."""
    mssd: Float
    """The largest distance of a point from itself."""
    mspd: Float
    """The largest in the image, without its lens's distortion; infinite where a point is behind the camera."""


def model_errors(points: Float, hull: Float, poses: Float, true_poses: Float, camera: Camera) -> ModelErrors:
    """Return the errors of `poses` (N, 4, 4) from `true_poses`, T_cam_body both.

    Args:
        points: (P, 3) of the model's surface, body axes, metres.
        hull: (H, 3) those whose convex hull is the model's: the largest distance is that of one of them.
    """
    from scipy.spatial import KDTree  # not above: it takes long to load

    nearest = KDTree(points)
    rows = [_of_one(points, hull, nearest, pose, true, camera) for pose, true in zip(poses, true_poses, strict=True)]
    add, add_s, mssd, mspd = np.array(rows, np.float64).reshape(-1, 4).T
    return ModelErrors(add=add, add_s=add_s, mssd=mssd, mspd=mspd)


def _of_one(
    points: Float, hull: Float, nearest: "KDTree", pose: Float, true: Float, camera: Camera
) -> tuple[float, float, float, float]:
    between = np.linalg.inv(pose) @ true  # from where a point is to the point predicted there, in the body's axes
    moved, far = _moved(points, between), _moved(hull, between) - hull
    here, there = _moved(hull, true), _moved(hull, pose)
    return (
        float(np.linalg.norm(moved - points, axis=1).mean()),
        float(np.mean(nearest.query(moved)[0])),
        float(np.linalg.norm(far, axis=1).max()),
        float(np.linalg.norm(_pixels(there, camera) - _pixels(here, camera), axis=1).max()),
    )


def _moved(points: Float, by: Float) -> Float:
    return np.asarray(points @ by[:3, :3].T + by[:3, 3])


def _pixels(points: Float, camera: Camera) -> Float:
    """Return the pixels (N, 2) through a pinhole; infinite behind it."""
    z = points[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(z > 0, points[:, :2] / z * (camera.fx, camera.fy), np.inf)


def found_share(errors: Float, diameter: float) -> float:
    """Return the share of the errors (N,), ADD or ADD-S, that is below a tenth of the diameter."""
    return float((errors < NEAR * diameter).mean())


def mssd_recall(errors: Float, diameter: float) -> float:
    """Return BOP's recall of MSSD (N,): the mean over its thresholds of the share below."""
    return float((errors < SHARES[:, None] * diameter).mean())


def mspd_recall(errors: Float, width: int) -> float:
    """Return BOP's recall of MSPD (N,) in pictures `width` pixels wide."""
    return float((errors < PIXELS[:, None] * width / BOP_WIDTH).mean())
