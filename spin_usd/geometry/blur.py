"""Blur radii of a point: by the circle of confusion of a thin lens, and between the poses of a motion.

Radii are lengths in undistorted normalised coordinates (x/z, y/z), where every blur has a closed form.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.basics.arrays import Float
from spin_usd.geometry import lens
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform

GRID = 33  # points per axis at which a lens's magnification is taken


def circle_of_confusion(depth: ArrayLike, *, radius: float, focus: float) -> Float:
    """Blur radius (N,) of points at `depth` (N,) before a thin lens whose aperture has `radius`; all metres, planar z.

    A ray from the place L of the aperture meets the plane of focus at focus * x: the point (X, Y, z) is seen at
    X/z + L (1/focus - 1/z). Source: M. Potmesil and I. Chakravarty, "A lens and aperture camera model" (1981).
    """
    with np.errstate(divide="ignore"):
        blur_radius: Float = radius * np.abs(1 / np.asarray(depth, np.float64) - 1 / focus)
    return blur_radius


def arc_height(radius: float, poses: tuple[Transform, ...]) -> float:
    """Return the most, metres, that a point `radius` from the centre of rotation can be off the straight line between
    its places in consecutive poses, between which the body turns steadily.

    It is the error of linear interpolation: an eighth of the step squared times the acceleration, here radius *
    angle**2 / 8.
    """
    angles = [rotation_angle(a, b) for a, b in pairwise(poses)]
    return radius * max(angles, default=0.0) ** 2 / 8


def rotation_angle(a: Transform, b: Transform) -> float:
    """Return the angle between two attitudes, radians."""
    sine = np.linalg.norm(a.rotation - b.rotation) / np.sqrt(8)  # of half the angle
    return float(2 * np.arcsin(min(sine, 1.0)))


def offset_blur_radius(points_cam: Float, offset: float) -> Float:
    """Blur radius (N,) of points (N, 3) that may lie `offset` metres from where they are, any way; infinite where that
    takes them to the camera."""
    x, y, z = points_cam.T
    if not offset:
        return np.zeros(len(z))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(z > offset, offset * (1 + np.hypot(x, y) / z) / (z - offset), np.inf)


@lru_cache(maxsize=16)
def magnification(camera: Camera) -> float:
    """Return the most pixels by which the lens makes a step of one in undistorted normalised coordinates, within the
    frame."""
    u, v = np.meshgrid(np.linspace(0, camera.width, GRID), np.linspace(0, camera.height, GRID))
    jacobian = lens.distortion_jacobian(camera.normalised(np.stack([u, v], -1)), camera.distortion)
    return float(np.linalg.norm(np.array([[camera.fx], [camera.fy]]) * jacobian, ord=2, axis=(-2, -1)).max())
