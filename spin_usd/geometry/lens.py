"""Distortion of normalised image coordinates, and its inverse, in double precision: Brown-Conrady with five
coefficients, in OpenCV's order k1, k2, p1, p2, k3; with four that of a fisheye (`fisheye.py`).

Source of the first: D. C. Brown, "Decentering distortion of lenses" (1966);
OpenCV's calib3d documentation gives the same formula. It stands in `distort` and `distortion_jacobian`, once more in
`_errors_and_steps`, where both share their terms for speed, and as text in the camera shader
(renderers.camera_shader.View.shader); tests hold them against one another.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import GeometryError
from spin_usd.geometry import fisheye
from spin_usd.geometry.fisheye import Fisheye

Coefficients = tuple[float, ...]
NEWTON_STEP = 1e-8  # of the points' largest radius; Newton squares the error, so a step of 1e-8 leaves 1e-16
MAX_STEPS = 200  # most lenses take four; next to the fold steps are halved
START = 0.9  # of the invertible radius: no search begins further out
SHORT_OF_FOLD = 0.999  # of the image's radius: nearer to its rim Newton's method takes many steps
CHUNK = 16384  # points worked on at once: their dozen temporaries fit a core's cache
DIRECTIONS = 64  # along which the fold is looked for; from one to the next it moves by a thousandth of itself
TOUCHING = 1e-6  # relative: a pair of complex roots so near to a real one is a fold, or as good as one
MONOTONE = "use coefficients that stay monotone over the whole frame"


def sees_right_angle(distortion: ArrayLike) -> bool:
    """Return whether the lens is a fisheye that is one to one up to a right angle from its axis."""
    return isinstance(distortion, Fisheye) and fisheye.seen_angle(distortion) == fisheye.RIGHT_ANGLE


def distort(xy: ArrayLike, distortion: ArrayLike) -> Float:
    """Distorted normalised coordinates (..., 2) of the undistorted `xy` (..., 2)."""
    points = np.asarray(xy, np.float64)
    x, y = points[..., 0], points[..., 1]
    if isinstance(distortion, Fisheye):
        return fisheye.distort(points, distortion)
    k1, k2, p1, p2, k3 = np.asarray(distortion, np.float64).tolist()
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    dx = 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    dy = p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    found = np.empty(points.shape)
    found[..., 0], found[..., 1] = x * radial + dx, y * radial + dy
    return found


def distortion_jacobian(xy: ArrayLike, distortion: ArrayLike) -> Float:
    """d(distorted)/d(undistorted), (..., 2, 2), at the undistorted `xy` (..., 2)."""
    if isinstance(distortion, Fisheye):
        return fisheye.jacobian(np.asarray(xy, np.float64), distortion)
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
    """Undistorted normalised coordinates (..., 2) of the distorted `xy` (..., 2).

    Raises GeometryError when a point has no inverse on the lens's own branch (the one that holds the centre). Beyond a
    right angle from a fisheye's axis there is nothing to see: those points have a ray next to it.
    """
    found, there = inverse(xy, distortion)
    if not there.all() and not (sees_right_angle(distortion) and np.isfinite(found).all()):
        radius = np.linalg.norm(np.asarray(xy, np.float64)[~there], axis=-1).max()
        k = np.asarray(distortion, np.float64).tolist()
        raise GeometryError(
            f"the lens distortion {k} cannot be inverted at normalised radius {radius:.4g}", do=MONOTONE
        )
    return found


def inverse(xy: ArrayLike, distortion: ArrayLike) -> tuple[Float, NDArray[np.bool_]]:
    """Undistorted normalised coordinates (..., 2) of the distorted `xy` (..., 2), and (...) whether there are any on
    the lens's own branch."""
    want = np.asarray(xy, np.float64)
    if isinstance(distortion, Fisheye):
        return fisheye.inverse(want, distortion)
    k = tuple(float(c) for c in np.asarray(distortion, np.float64))
    if not any(k):
        return want.copy(), np.ones(want.shape[:-1], bool)
    flat = want.reshape(-1, 2)
    found, there = np.empty_like(flat), np.empty(len(flat), bool)
    for start in range(0, len(flat), CHUNK):
        chunk = slice(start, start + CHUNK)
        found[chunk, 0], found[chunk, 1], there[chunk] = _newton(flat[chunk, 0], flat[chunk, 1], k)
    return found.reshape(want.shape), there.reshape(want.shape[:-1])


def _newton(x0: Float, y0: Float, k: Coefficients) -> tuple[Float, Float, NDArray[np.bool_]]:
    """`inverse` of the coordinates x0 and y0 (N,), few enough for the processor's cache.

    By Newton's method, whose steps are halved until they stay within the invertible disc and lessen the error: so none
    leads to another branch, and next to the fold, where the plain method goes round in circles, they still arrive.
    """
    limit = invertible_radius(k)
    done = NEWTON_STEP * min(float(np.hypot(x0, y0).max(initial=0)), 1.0)
    x, y = _start(x0, y0, k, START * limit)
    ex, ey, dx, dy = _errors_and_steps(x, y, x0, y0, k)
    error, share = ex * ex + ey * ey, np.ones(len(x))
    for _ in range(MAX_STEPS):
        arrived = (np.abs(dx) <= done) & (np.abs(dy) <= done)
        nx, ny = x - share * dx, y - share * dy
        ex, ey, ndx, ndy = _errors_and_steps(nx, ny, x0, y0, k)
        less = ex * ex + ey * ey
        better = (nx * nx + ny * ny < limit * limit) & ((less < error) | arrived)
        if better.all():
            x, y, dx, dy, error = nx, ny, ndx, ndy, less
        else:
            x, y, error = np.where(better, nx, x), np.where(better, ny, y), np.where(better, less, error)
            dx, dy = np.where(better, ndx, dx), np.where(better, ndy, dy)
        if arrived.all():
            return x, y, arrived
        share = np.where(better, np.minimum(2 * share, 1), share / 2)
    return x, y, arrived


def _start(x0: Float, y0: Float, k: Coefficients, limit: float) -> tuple[Float, Float]:
    """Return a first guess at `inverse`, within the radius `limit`."""
    r2 = x0 * x0 + y0 * y0
    shrink = 1 / np.maximum(1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4])), 0.1)
    shrink = np.minimum(shrink, limit / np.maximum(np.sqrt(r2), np.finfo(float).tiny))
    return x0 * shrink, y0 * shrink


def _errors_and_steps(x: Float, y: Float, x0: Float, y0: Float, k: Coefficients) -> tuple[Float, Float, Float, Float]:
    """Return the errors by which the distorted (x, y) misses (x0, y0), and Newton's step to subtract: `distort` and
    `distortion_jacobian` in one, as the camera shader has them."""
    k1, k2, p1, p2, k3 = k
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
    return ex, ey, (d * ex - b * ey) / det, (a * ey - b * ex) / det


@lru_cache(maxsize=64)
def invertible_radius(distortion: Coefficients) -> float:
    """Undistorted radius below which the map is one to one; infinity when it is so everywhere.

    The map is the gradient of a potential, so its Jacobian is symmetric. On a disc on which the determinant stays
    above zero the Jacobian, the identity at the centre, is positive definite: the potential is strictly convex there
    and its gradient one to one. The disc ends at the least root of the determinant, a polynomial of the radius along
    each of DIRECTIONS.
    """
    if isinstance(distortion, Fisheye):
        end = fisheye.seen_angle(distortion)
        return float(np.tan(end)) if end < fisheye.RIGHT_ANGLE else float("inf")
    if not any(distortion):
        return float("inf")
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    return min(map(_least_root, _determinants(np.cos(angle), np.sin(angle), distortion)))


@lru_cache(maxsize=64)
def image_radius(distortion: Coefficients) -> float:
    """Distorted radius within which every point has an inverse; infinity when all have one.

    The image of the invertible disc holds the disc around its centre that all but touches the image of its rim.
    """
    if isinstance(distortion, Fisheye):
        return float(fisheye.distances(np.array(fisheye.seen_angle(distortion)), distortion)[0])
    limit = invertible_radius(distortion)
    if not np.isfinite(limit):
        return float("inf")
    angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    rim = distort(limit * np.stack([np.cos(angle), np.sin(angle)], -1), distortion)
    return SHORT_OF_FOLD * float(np.linalg.norm(rim, axis=1).min())


def _determinants(cosine: Float, sine: Float, k: Coefficients) -> Float:
    """Return (N, 13) coefficients, lowest power of the radius first, of the Jacobian's determinant along N
    directions."""
    k1, k2, p1, p2, k3 = k
    radial, slope = np.array([1, 0, k1, 0, k2, 0, k3]), np.array([0, 0, 2 * k1, 0, 4 * k2, 0, 6 * k3])
    first = np.eye(7)[1]

    def row(c: float, s: float) -> Float:
        xx = radial + slope * c * c + first * (2 * p1 * s + 6 * p2 * c)
        yy = radial + slope * s * s + first * (6 * p1 * s + 2 * p2 * c)
        xy = slope * c * s + first * (2 * p1 * c + 2 * p2 * s)
        return np.convolve(xx, yy) - np.convolve(xy, xy)

    return np.array([row(c, s) for c, s in zip(cosine, sine, strict=True)])


def _least_root(coefficients: Float) -> float:
    """Return the least positive root of a polynomial (lowest power first) that is 1 at 0; infinity where there is
    none."""
    # Of the reciprocal, which is monic whatever the degree, in a unit in which no coefficient is large.
    unit = float(max(np.abs(c) ** (1 / i) for i, c in enumerate(coefficients) if i))
    roots = np.roots(coefficients / unit ** np.arange(len(coefficients)))
    real = roots.real[(roots.real > 0) & (np.abs(roots.imag) <= TOUCHING * roots.real)]
    return float(1 / (unit * real.max())) if unit and len(real) else float("inf")
