"""The fisheye lens of Kannala and Brandt, as OpenCV's module fisheye has it, and its inverse, in double precision.

A ray at the angle t from the axis is seen at the distance t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) from the principal
point, in focal lengths. Coordinates are those of `lens`: x/z and y/z, which a ray at a right angle has none of. Pixels
beyond it see nothing; where a ray has to be said, they have one at GRAZING. Source: J. Kannala and S. S. Brandt, "A
generic camera model and calibration method" (2006); OpenCV's documentation of calib3d ("Fisheye camera model").
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

RIGHT_ANGLE = np.pi / 2
GRAZING = RIGHT_ANGLE - 1e-6  # radians
STEPS = 60  # bisections alone would take 53; Newton's method takes four
REAL = 1e-9  # imaginary parts up to this, relative, are a root's rounding


class Fisheye(NamedTuple):
    """The lens's four coefficients, of a type of their own: four numbers alone are k1, k2, p1, p2 to most."""

    k1: float
    k2: float
    k3: float
    k4: float


def distances(angle: Float, k: Fisheye) -> tuple[Float, Float]:
    """Return how far from the principal point the angles (...) are seen, in focal lengths, and the slope of that."""
    k1, k2, k3, k4 = k
    t2 = angle * angle
    far = angle * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    return far, 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))


def distort(xy: Float, k: Fisheye) -> Float:
    """Return distorted coordinates (..., 2) of the undistorted `xy` (..., 2)."""
    radius = np.hypot(xy[..., 0], xy[..., 1])
    far = distances(np.arctan(radius), k)[0]
    share = np.divide(far, radius, out=np.ones_like(radius), where=radius != 0)
    return np.asarray(xy * share[..., None])


def jacobian(xy: Float, k: Fisheye) -> Float:
    """Return d(distorted)/d(undistorted), (..., 2, 2), at the undistorted `xy` (..., 2)."""
    radius = np.hypot(xy[..., 0], xy[..., 1])
    far, slope = distances(np.arctan(radius), k)
    across = np.divide(far, radius, out=np.ones_like(radius), where=radius != 0)
    outward = np.divide(xy, radius[..., None], out=np.zeros_like(xy), where=radius[..., None] != 0)
    along = slope / (1 + radius * radius) - across
    turned = along[..., None, None] * outward[..., None] * outward[..., None, :]
    return np.asarray(across[..., None, None] * np.eye(2) + turned)


def inverse(xy: Float, k: Fisheye) -> tuple[Float, NDArray[np.bool_]]:
    """Return undistorted coordinates (..., 2) of the distorted `xy` (..., 2), and (...) whether these are seen; others
    get those at the edge of what is."""
    far = np.hypot(xy[..., 0], xy[..., 1])
    there = far < distances(np.array(seen_angle(k)), k)[0]
    share = np.divide(np.tan(np.minimum(angles(far, k), GRAZING)), far, out=np.ones_like(far), where=far != 0)
    return np.asarray(xy * share[..., None]), np.asarray(there)


def angles(far: Float, k: Fisheye) -> Float:
    """Return the angles (...) of what is seen `far` (...) from the principal point; that of the edge beyond it."""
    most = seen_angle(k)
    low, high = np.zeros_like(far), np.full_like(far, most)
    angle = np.minimum(far, 0.9 * most)
    for _ in range(STEPS):
        reached, slope = distances(angle, k)
        low, high = np.where(reached < far, angle, low), np.where(reached >= far, angle, high)
        step = angle - (reached - far) / slope
        step = np.where((step >= low) & (step <= high), step, (low + high) / 2)
        if (np.abs(step - angle) <= np.spacing(angle)).all():
            break
        angle = step
    return np.asarray(np.minimum(angle, most))


@lru_cache(maxsize=64)
def seen_angle(k: Fisheye) -> float:
    """Return the angle from the axis, radians, up to which angles and distances are one to one; a right one at most."""
    k1, k2, k3, k4 = k
    roots = np.roots([9 * k4, 7 * k3, 5 * k2, 3 * k1, 1.0])  # of the slope, in the angle's square
    real = roots.real[(roots.real > 0) & (np.abs(roots.imag) <= REAL * np.abs(roots.real))]
    return min(float(np.sqrt(real.min())) if len(real) else RIGHT_ANGLE, RIGHT_ANGLE)
