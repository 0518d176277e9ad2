"""The truth of a small scene in 80-bit arithmetic, from its numbers as they were written, without the product's code.

Every triangle is tried on every pixel's ray. Lenses follow the formula of OpenCV's calib3d documentation; the tests
hold it against OpenCV itself.
"""

from dataclasses import dataclass

import numpy as np

Long = np.longdouble
HALF_ULP = np.finfo(Long).eps / 2  # 2**-64 on x86: 2,000 times finer than what it judges
CONTINUATION = 24  # parts of the way from the centre to a pixel, each solved from the one before
NEWTON_STEPS = 5


@dataclass(frozen=True, kw_only=True)
class Hits:
    """Of each pixel (N,), in row-major order: the first face, -1 for none; its planar depth, metres; the body point
    (N, 3), metres. rays (N, 2): undistorted normalised coordinates; least, most (N,): by how much the lens shrinks and
    stretches there."""

    face: np.ndarray
    z: np.ndarray
    body: np.ndarray
    rays: np.ndarray
    least: np.ndarray
    most: np.ndarray


def rotation(q):
    """(3, 3) of a quaternion of any length, scalar first."""
    w, x, y, z = np.asarray(q, Long) / np.sqrt((np.asarray(q, Long) ** 2).sum())
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ],
        Long,
    )


def distorted(xy, k):
    """(N, 2) of undistorted normalised coordinates (N, 2), by OpenCV's formula; and its Jacobian's xx, xy, yy (N,)."""
    x, y = np.asarray(xy, Long).T
    k1, k2, p1, p2, k3 = np.asarray(k, Long)
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    growth = 2 * (k1 + 2 * k2 * r2 + 3 * k3 * r2**2)
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    xx = radial + growth * x * x + 2 * p1 * y + 6 * p2 * x
    yy = radial + growth * y * y + 6 * p1 * y + 2 * p2 * x
    return np.stack([u, v], -1), (xx, growth * x * y + 2 * p1 * x + 2 * p2 * y, yy)


def undistorted(want, k):
    """(N, 2) of distorted normalised coordinates (N, 2): followed from the centre outwards, so on the lens's own
    branch."""
    want = np.asarray(want, Long)
    found = np.zeros_like(want)
    for part in range(1, CONTINUATION + 1):
        for _ in range(NEWTON_STEPS):
            at, (a, b, d) = distorted(found, k)
            ex, ey = (at - want * part / CONTINUATION).T
            det = a * d - b * b
            found = found - np.stack([(d * ex - b * ey) / det, (a * ey - b * ex) / det], -1)
    return found


def stretch(xy, k):
    """Least and most (N,) by which the lens magnifies at (N, 2)."""
    _, (a, b, d) = distorted(xy, k)
    middle, half = (a + d) / 2, np.sqrt(((a - d) / 2) ** 2 + b * b)
    return middle - half, middle + half


def pixel_rays(camera):
    """Undistorted normalised coordinates (N, 2) of all pixel centres, row by row."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width] + Long(0.5)
    xy = np.stack([(u - Long(camera.cx)) / Long(camera.fx), (v - Long(camera.cy)) / Long(camera.fy)], -1).reshape(-1, 2)
    return undistorted(xy, camera.distortion) if any(camera.distortion) else xy


def hits(camera, q, t, points, faces):
    """What the camera sees of the mesh, whose pose is `q` (4,), not necessarily of unit length, and `t` (3,)."""
    R, t = rotation(q), np.asarray(t, Long)
    corners = (np.asarray(points, Long) @ R.T + t)[np.asarray(faces)]
    rays = pixel_rays(camera)
    d = np.concatenate([rays, np.ones((len(rays), 1), Long)], 1)
    z, face = np.full(len(d), np.inf, Long), np.full(len(d), -1)
    for number, (a, b, c) in enumerate(corners):
        depth, weights = on_plane(d, a, b, c)
        closer = (weights >= 0).all(0) & (depth > 0) & (depth < z)
        z, face = np.where(closer, depth, z), np.where(closer, number, face)
    seen = face >= 0
    at = np.where(seen, z, 1)[:, None] * d
    least, most = stretch(rays, camera.distortion)
    return Hits(
        face=face,
        z=np.where(seen, z, 0),
        body=np.where(seen[:, None], (at - t) @ R, 0),
        rays=rays,
        least=least,
        most=most,
    )


def on_plane(d, a, b, c):
    """Depth (N,) at which the rays d (N, 3) meet the plane of a triangle, and their weights (3, N) in it; NaN and -1
    where they run along it. Weights are volumes, so an edge that two triangles share has one sign for both."""
    sides = np.stack([d @ np.cross(b, c), d @ np.cross(c, a), d @ np.cross(a, b)])
    normal = np.cross(b - a, c - a)
    slope = d @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = (a @ normal) / slope
        weights = sides / slope
    return depth, np.where(np.isfinite(weights), weights, -1)


def project(camera, points):
    """Pixels (N, 2) of points (N, 3) in the camera frame."""
    xy = points[:, :2] / points[:, 2:]
    uv, _ = distorted(xy, camera.distortion)
    return uv * (Long(camera.fx), Long(camera.fy)) + (Long(camera.cx), Long(camera.cy))
