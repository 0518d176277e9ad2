"""Normals: which way the surface that each pixel shows faces, in the camera's axes and in the target's.

They are geometric: a face's own, not the smooth ones that shade it. So they are exact, and stand across the dense
pose's surface.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture
from spin_usd.labels.preview import by_direction
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene

UNIT = 1e-6  # float32 rounds each component to 6e-8
SAME = 1e-6  # between components of normals that are of one plane
ACROSS = 1e-3  # cosine between a normal and a way along its own plane, with room for float32 in a normal dense pose
FLOAT32 = 2.4e-7  # four roundings of coordinates, relative
FEW = 100  # neighbours, of whose share nothing follows
MIN_SHARE = 0.5  # of the neighbours on one plane lie across the normal; others are of planes behind one another


def normals_cam(scene: Scene, surface: Surface) -> NDArray[np.float32]:
    """Return (H, W, 3) float32: unit normals in the camera's axes, towards the camera; 0 for no surface."""
    return surface.image_of(lambda one, rows: one.T_cam_body.directions(surface.normals[rows]), (3,), np.float32)


def normals_body(scene: Scene, surface: Surface) -> NDArray[np.float32]:
    """Return (H, W, 3) float32: unit normals in the axes of the target that is seen, towards the camera; 0 where none
    is."""
    return surface.image(surface.normals, np.float32, surface.of_targets)


def faults_cam(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Normals in the camera's axes are unit, face the camera, and are the body's turned by the pose."""
    normals = picture.arrays["normals_cam"].astype(np.float64)
    yield from _unit_faults(normals, picture.arrays.get("segmentation"), "normals_cam")
    rows, columns = np.nonzero(normals.any(-1))
    rays = picture.camera.rays(np.stack([columns + 0.5, rows + 0.5], -1))
    away = (normals[rows, columns] * rays).sum(-1) / np.linalg.norm(rays, axis=-1)
    if not away.max(initial=0) <= UNIT:
        yield LabelFault(code="normals", message="normals_cam holds normals that face away from the camera")
    off = _largest_turn(picture, normals)
    if not off <= UNIT:
        yield LabelFault(code="normals", message=f"normals_cam and normals_body differ by {off:.3g}")


def faults_body(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Normals in the targets' axes are unit, and stand across the dense pose."""
    normals = picture.arrays["normals_body"].astype(np.float64)
    yield from _unit_faults(normals, picture.target_ids, "normals_body")
    if "dense_pose" in picture.arrays:
        parts = picture.arrays.get("segmentation", np.zeros(normals.shape[:2]))
        share = _share_across(normals, picture.arrays["dense_pose"].astype(np.float64), parts)
        if share < MIN_SHARE:
            found = f"only {share:.0%} of neighbouring points of one plane lie across normals_body"
            yield LabelFault(code="normals", message=found)


def _unit_faults(normals: Float, ids: NDArray[np.uint16] | None, name: str) -> Iterator[LabelFault]:
    """Yield a fault where the normals (H, W, 3) are not there for the `ids` (H, W) above 0 alone, or not unit."""
    seen = normals.any(-1)
    if ids is not None and (seen != (ids > 0)).any():
        yield LabelFault(code="support", message=f"segmentation and {name} cover different pixels")
    off = np.abs(np.linalg.norm(normals[seen], axis=-1) - 1).max(initial=0)
    if not off <= UNIT:
        yield LabelFault(code="normals", message=f"{name} holds normals whose length is off by {off:.3g}")


def _largest_turn(picture: LabelledPicture, normals: Float) -> float:
    """Return the largest difference between the normals (H, W, 3), camera axes, and those in the targets' axes turned
    by their poses; 0 where these are not there."""
    own, ids = picture.arrays.get("normals_body"), picture.target_ids
    if own is None or ids is None:
        return 0.0
    turns = ((pose.directions(own[ids == number]), normals[ids == number]) for number, pose in picture.poses.items())
    return max((float(np.abs(turned - found).max(initial=0)) for turned, found in turns), default=0.0)


def _share_across(normals: Float, points: Float, parts: NDArray[Any]) -> float:
    """Return the share, of neighbours in a row of one part (H, W) with the same normal, whose points (H, W, 3) lie
    beside one another across it; 1 for fewer than FEW: a target of few pixels may show mostly planes behind one
    another."""
    both = normals[:, :-1].any(-1) & normals[:, 1:].any(-1)
    both &= (np.abs(normals[:, 1:] - normals[:, :-1]) <= SAME).all(-1) & (parts[:, 1:] == parts[:, :-1])
    if both.sum() < FEW:
        return 1.0
    along, normal = (points[:, 1:] - points[:, :-1])[both], normals[:, 1:][both]
    rounding = FLOAT32 * np.abs(points[:, 1:][both]).max(-1, initial=0)
    across = np.abs((along * normal).sum(-1)) <= ACROSS * np.linalg.norm(along, axis=-1) + rounding
    return float(across.mean()) if len(across) else 1.0


NORMALS_CAM = Label(
    name="normals_cam",
    make=normals_cam,
    channels=Channels(
        meaning="the unit normal of the face seen, towards the camera, x, y, z in the camera's axes: float32 channels "
        "R, G, B; 0 = nothing",
        dtype="float32",
        holds={"R": "x", "G": "y", "B": "z"},
        frame="cam",
    ),
    suffix=".exr",
    usd_type="normal3f",
    file_bytes=0.6,
    target_s=5e-08,
    preview=by_direction,
    faults=faults_cam,
)
NORMALS_BODY = Label(
    name="normals_body",
    make=normals_body,
    channels=Channels(
        meaning="the unit normal of the face seen, towards the camera, x, y, z in the target's body frame: float32 "
        "channels R, G, B; 0 = nothing",
        dtype="float32",
        holds={"R": "x", "G": "y", "B": "z"},
        frame="body",
    ),
    suffix=".exr",
    usd_type="normal3f",
    file_bytes=0.5,
    target_s=5e-08,
    preview=by_direction,
    faults=faults_body,
)
