"""Where a target's keypoints are in the picture, and whether they can be seen."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.bounds import NEAR
from spin_usd.renderers.embree.caster import EmbreeCaster
from spin_usd.scene.derived.surface import surface_points
from spin_usd.scene.keypoints import KeypointState
from spin_usd.scene.scene import OneBody

SKIN = 5e-3  # of the longest edge of the target's bounding box
ROUNDING = 1e-6  # of the same: of depths


def skin(size: Float) -> float:
    """Return the distance before a keypoint, metres along the ray, within which a surface of its own body does not hide
    it; `size` (3,) of the body's bounding box, metres."""
    return SKIN * float(size.max())


def keypoint_states(
    scenes: Sequence[OneBody], own: int, caster: EmbreeCaster
) -> tuple[Float, tuple[KeypointState, ...]]:
    """Return the pixels (N, 2), NaN where the lens sees none or the part is missing, and the states of the keypoints
    of the target of `scenes[own]`."""
    camera, points = scenes[own].camera, scenes[own].T_cam_body.points(scenes[own].target.keypoints)
    uv, shape = camera.project(points), scenes[own].target.shape
    if shape:
        uv[shape.keypoint_missing] = np.nan
    states = np.where(points[:, 2] > NEAR, KeypointState.OUTSIDE, KeypointState.BEHIND).astype(object)
    looked = np.flatnonzero(((uv >= 0) & (uv < (camera.width, camera.height))).all(1))
    if len(looked):
        hiding = _hiding(scenes, own, points[looked], caster)
        hidden = np.where(hiding == own, KeypointState.SELF_OCCLUDED, KeypointState.OCCLUDED)
        states[looked] = np.where(hiding < 0, KeypointState.VISIBLE, hidden)
    if shape:
        states[shape.keypoint_missing] = KeypointState.MISSING
    return uv, tuple(KeypointState(state) for state in states)


def _hiding(scenes: Sequence[OneBody], own: int, points: Float, caster: EmbreeCaster) -> NDArray[np.intp]:
    """Return (N,) the place of the first body before each of the points (N, 3), camera frame, of the target of
    `scenes[own]`; -1 if there is none."""
    xy = points[:, :2] / points[:, 2:]
    size = scenes[own].target.mesh.size
    own_skin, rounding = skin(size), ROUNDING * float(size.max())
    along = points[:, 2] / np.linalg.norm(points, axis=1)  # a length along the ray, as depth
    depth = np.full((len(scenes), len(xy)), np.inf)
    for place, scene in enumerate(scenes):
        face = caster.cast(scene, xy)
        met = np.flatnonzero(face >= 0)
        depth[place, met] = surface_points(scene, face[met], xy[met])[0]
        depth[place, depth[place] >= points[:, 2] - (own_skin if place == own else rounding) * along] = np.inf
    return np.where(np.isfinite(depth).any(0), depth.argmin(0), -1)
