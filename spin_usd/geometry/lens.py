"""Brown-Conrady distortion of normalised image coordinates, and its inverse, in double precision.

Coefficients in OpenCV's order k1, k2, p1, p2, k3. Source: D. C. Brown, "Decentering distortion of lenses"
(1966); OpenCV's calib3d documentation gives the same formula.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.arrays import Float
from spin_usd.errors import GeometryError

Coefficients = tuple[float, ...]
NEWTON_STEP = 1e-8  # normalised units; Newton squares the error, so a step of 1e-8 leaves 1e-16
NEWTON_STEPS = 50
REBOUND = 0.9  # of the invertible radius, where a step that left the branch goes on from (0.99 and 0.5 can cycle)
CHUNK = 16384  # points worked on at once: their dozen temporaries fit a core's cache


def distort(xy: ArrayLike, distortion: ArrayLike) -> Float:
    """Distorted normalised coordinates (..., 2) of the undistorted `xy` (..., 2)."""
    x, y = np.moveaxis(np.asarray(xy, np.float64), -1, 0)
    k1, k2, p1, p2, k3 = np.asarray(distortion, np.float64)
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    dx = 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    dy = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([x * radial + dx, y * radial + dy], -1)


def distortion_jacobian(xy: ArrayLike, distortion: ArrayLike) -> Float:
    """d(distorted)/d(undistorted), (..., 2, 2), at the undistorted `xy` (..., 2)."""
    x, y = np.moveaxis(np.asarray(xy, np.float64), -1, 0)
    k1, k2, p1, p2, k3 = np.asarray(distortion, np.float64)
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))  # d(radial)/d(r2) * 2
    cross = slope * x * y + 2 * p1 * x + 2 * p2 * y
    xx = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x
    yy = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x
    return np.stack([np.stack([xx, cross], -1), np.stack([cross, yy], -1)], -2)


def undistort(xy: ArrayLike, distortion: ArrayLike) -> Float:
    """Undistorted normalised coordinates (..., 2) of the distorted `xy` (..., 2), by Newton's method.

    Raises GeometryError when a point has no inverse on the lens's own branch (the one that holds the centre).
    """
    want = np.asarray(xy, np.float64)
    k = tuple(float(c) for c in np.asarray(distortion, np.float64))
    if not any(k):
        return want.copy()
    flat = want.reshape(-1, 2)
    found = np.empty_like(flat)
    limit = invertible_radius(k)
    for start in range(0, len(flat), CHUNK):
        chunk = slice(start, start + CHUNK)
        found[chunk, 0], found[chunk, 1] = _newton(flat[chunk, 0].copy(), flat[chunk, 1].copy(), k, limit)
    return found.reshape(want.shape)


def _newton(x0: Float, y0: Float, k: Coefficients, limit: float) -> tuple[Float, Float]:
    """`undistort` of the coordinates x0 and y0 (N,), few enough for the processor's cache."""
    k1, k2, p1, p2, k3 = k
    r2 = x0 * x0 + y0 * y0
    shrink = 1 / np.maximum(1 + r2 * (k1 + r2 * (k2 + r2 * k3)), 0.1)
    x, y = x0 * shrink, y0 * shrink
    for _ in range(NEWTON_STEPS):
        xx, yy, xy = x * x, y * y, x * y
        r2 = xx + yy
        if float(r2.max(initial=0)) >= limit * limit:
            x, y = _within(x, y, REBOUND * limit)
            xx, yy, xy = x * x, y * y, x * y
            r2 = xx + yy
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        ex = x * radial + 2 * p1 * xy + p2 * (r2 + 2 * xx) - x0
        ey = y * radial + p1 * (r2 + 2 * yy) + 2 * p2 * xy - y0
        slope = 2 * (k1 + r2 * (2 * k2 + 3 * k3 * r2))
        a = radial + slope * xx + 2 * p1 * y + 6 * p2 * x
        b = slope * xy + 2 * p1 * x + 2 * p2 * y
        d = radial + slope * yy + 6 * p1 * y + 2 * p2 * x
        det = a * d - b * b
        dx, dy = (d * ex - b * ey) / det, (a * ey - b * ex) / det
        x -= dx
        y -= dy
        if max(np.abs(dx).max(initial=0), np.abs(dy).max(initial=0)) < NEWTON_STEP and (det > 0).all():
            return x, y
    reach = np.sqrt((x0 * x0 + y0 * y0).max())
    raise GeometryError(
        f"the lens distortion {list(k)} cannot be inverted at normalised radius {reach:.4g}",
        do="use coefficients that stay monotone over the whole frame",
    )


def _within(x: Float, y: Float, radius: float) -> tuple[Float, Float]:
    """The points pulled back into the disc of `radius`: beyond the fold Newton would find another branch."""
    shrink = np.minimum(radius / np.maximum(np.hypot(x, y), radius), 1)
    return x * shrink, y * shrink


@lru_cache(maxsize=64)
def invertible_radius(distortion: Coefficients) -> float:
    """Undistorted radius below which the map is one to one; infinity when it is so to radius 20 (87 degrees).

    The map is the gradient of a potential, so its Jacobian is symmetric. On a disc on which the determinant stays
    above zero the Jacobian, the identity at the centre, is positive definite: the potential is strictly convex there
    and its gradient one to one. The disc ends at the first radius, of a grid along 64 directions, that breaks this.
    """
    k = np.asarray(distortion, np.float64)
    if not k.any():
        return float("inf")
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    radius = np.concatenate([np.linspace(0, 2, 2001), np.linspace(2, 20, 1801)[1:]])
    ray = np.stack([np.cos(angle), np.sin(angle)], -1)
    jacobian = distortion_jacobian(radius[:, None, None] * ray, k)
    determinant = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] ** 2
    singular = (determinant <= 0).any(axis=1)
    return float(radius[np.argmax(singular)]) if singular.any() else float("inf")
