"""Rays as Embree is given them: body axes around the target's centre, in units of the target's radius."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.rotation import product
from spin_usd.scene.model import Scene

Float32 = NDArray[np.float32]

MARGIN = 1.001  # of the bounding sphere's radius: rays start a little outside


def rays_in_target_units(scene: Scene, xy: Float) -> tuple[Float32, Float32]:
    """Return origins and unit directions (N, 3), in body axes around the target's centre, in units of its radius, of
    the camera's rays (x, y, 1) of `xy` (N, 2).

    Rays start where they enter the target's bounding sphere, or at the camera, behind which nothing is seen.
    """
    mesh, pose = scene.target.mesh, scene.T_cam_body
    cx, cy, cz = pose.points(mesh.centre) / mesh.radius
    x, y = xy[:, 0], xy[:, 1]
    # The ray's point at the centre's depth, seen from the centre: the range cancels here, in double precision.
    wx, wy = (cz * x - cx).astype(np.float32), (cz * y - cy).astype(np.float32)
    length = np.sqrt(x * x + y * y + 1)
    towards = np.stack([x / length, y / length, 1 / length], -1).astype(np.float32)
    along = wx * towards[:, 0] + wy * towards[:, 1]
    half_chord = np.sqrt(np.maximum(np.float32(MARGIN**2) - (wx * wx + wy * wy - along * along), 0))
    start = np.maximum(-along - half_chord, (-cz * length).astype(np.float32))
    origins = start[:, None] * towards
    origins[:, 0] += wx
    origins[:, 1] += wy
    to_body = pose.rotation.T.astype(np.float32)
    return product(to_body, origins), product(to_body, towards)


def rays_entering(origin: Float, directions: Float) -> tuple[Float32, Float32]:
    """Return origins and unit directions (N, 3), in body axes around the target's centre, in units of its radius, of
    the rays from `origin` (3,) along the unit `directions` (N, 3), which are in the same axes and units.

    Rays start where they enter the target's bounding sphere; from within it, at `origin`.
    """
    along = -(directions * origin).sum(1)
    nearest = origin + along[:, None] * directions
    half_chord = np.sqrt(np.maximum(MARGIN**2 - (nearest * nearest).sum(1), 0))
    start = np.maximum(-half_chord, -along)
    return (nearest + start[:, None] * directions).astype(np.float32), directions.astype(np.float32)
