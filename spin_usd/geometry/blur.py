"""How far a picture smears a point: by the circle of confusion of a thin lens, and between the poses of a motion.

Reaches are lengths in undistorted normalised coordinates (x/z, y/z), where every blur has a closed form.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform

DIRECTIONS = 16  # in which a reach is followed through the lens; the polygon they span is 2 % larger than its circle


def circle_of_confusion(depth: ArrayLike, *, radius: float, focus: float) -> Float:
    """Reach (N,) of points at `depth` (N,) before a thin lens whose aperture has `radius`; all metres, planar z.

    A ray from the place L of the aperture meets the plane of focus at focus * x: the point (X, Y, z) is seen at
    X/z + L (1/focus - 1/z). Source: M. Potmesil and I. Chakravarty, "A lens and aperture camera model" (1981).
    """
    with np.errstate(divide="ignore"):
        reach: Float = radius * np.abs(1 / np.asarray(depth, np.float64) - 1 / focus)
    return reach


def arc_height(radius: float, poses: tuple[Transform, ...]) -> float:
    """How far, metres, a point `radius` from the centre of rotation can be off the straight line between its places in
    consecutive poses, which turn steadily from one to the next.

    The error of linear interpolation: an eighth of the step squared times the acceleration, here radius * angle**2 / 8.
    """
    angles = [rotation_angle(a, b) for a, b in pairwise(poses)]
    return radius * max(angles, default=0.0) ** 2 / 8


def rotation_angle(a: Transform, b: Transform) -> float:
    """The angle between two attitudes, radians."""
    sine = np.linalg.norm(a.rotation - b.rotation) / np.sqrt(8)  # of half the angle
    return float(2 * np.arcsin(min(sine, 1.0)))


def offset_reach(points_cam: Float, offset: float) -> Float:
    """Reach (N,) of points (N, 3) that may lie `offset` metres from where they are, any way; infinite where that takes
    them to the camera."""
    x, y, z = points_cam.T
    if not offset:
        return np.zeros(len(z))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(z > offset, offset * (1 + np.hypot(x, y) / z) / (z - offset), np.inf)


def reach_px(camera: Camera, xy: Float, reach: Float) -> float:
    """The furthest, in pixels of `camera`, that a `reach` (N,) takes a point of `xy` (N, 2), normalised."""
    turn = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    rim = np.stack([np.cos(turn), np.sin(turn)], -1) / np.cos(np.pi / DIRECTIONS)
    moved = camera.pixels(xy[:, None] + reach[:, None, None] * rim)
    return float(np.abs(moved - camera.pixels(xy)[:, None]).max(initial=0))
