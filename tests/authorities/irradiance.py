"""Irradiance by formulas: what a point on a plane receives from a light of given radiance. Double precision.

Everything is in one frame; `p` and `n` are the receiving point and its unit normal.
"""

import numpy as np


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


def point(intensity, centre, p, n):
    """The inverse-square and the cosine law."""
    to = np.asarray(centre, float) - p
    return intensity * max(unit(to) @ n, 0) / (to @ to)


def sphere(radiance, centre, radius, p, n):
    """pi L (r / d)^2 cos: exact for a sphere wholly above the horizon (Nusselt's analog)."""
    to = np.asarray(centre, float) - p
    assert to @ n >= radius
    return np.pi * radiance * radius**2 / (to @ to) * (unit(to) @ n)


def polygon(radiance, corners, p, n):
    """Lambert's formula for a polygon (N, 3) wholly above the horizon: L / 2 times the sum of its edges' angles, each
    times the cosine between the edge's plane and the receiver's. Baum, Rushmeier and Winget (1989)."""
    corners = np.asarray(corners, float) - p
    total = 0.0
    for a, b in zip(corners, np.roll(corners, -1, 0), strict=True):
        cross = np.cross(a, b)
        total += np.arctan2(np.linalg.norm(cross), a @ b) * (unit(cross) @ n)
    return radiance * abs(total) / 2


def surface(emitted, points, normals, areas, p, n):
    """The integral over a surface in small pieces (N, 3), (N, 3), (N,), each shining outwards: `emitted` is its
    radiance into unit directions (N, 3)."""
    to = points - p
    squared = np.sum(to**2, 1)
    towards = to / np.sqrt(squared)[:, None]
    received = np.maximum(towards @ n, 0) * np.maximum(-np.sum(towards * normals, 1), 0) / squared
    return float(np.sum(emitted(-towards) * received * areas))


def disk_pieces(rx, ry, count=400):
    """An ellipse in the plane z = 0, facing -z: midpoints of rings and sectors of equal area."""
    r = np.sqrt((np.arange(count) + 0.5) / count)
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    r, angle = (grid.ravel() for grid in np.meshgrid(r, angle))
    points = np.stack([rx * r * np.cos(angle), ry * r * np.sin(angle), 0 * r], -1)
    return points, np.tile([0.0, 0, -1], (len(r), 1)), np.full(len(r), np.pi * rx * ry / len(r))


def rect_pieces(width, height, count=400):
    """A rectangle in the plane z = 0, facing -z."""
    x, y = np.meshgrid(*[(np.arange(count) + 0.5) / count - 0.5] * 2)
    points = np.stack([width * x.ravel(), height * y.ravel(), 0 * x.ravel()], -1)
    return points, np.tile([0.0, 0, -1], (x.size, 1)), np.full(x.size, width * height / x.size)


def sphere_pieces(radius, count=700):
    """A sphere in pieces of equal area: equal steps of z and of longitude."""
    z, angle = np.meshgrid(2 * (np.arange(count) + 0.5) / count - 1, 2 * np.pi * (np.arange(count) + 0.5) / count)
    z, angle = z.ravel(), angle.ravel()
    s = np.sqrt(1 - z**2)
    normals = np.stack([s * np.cos(angle), s * np.sin(angle), z], -1)
    return radius * normals, normals, np.full(z.size, 4 * np.pi * radius**2 / z.size)


def tube_pieces(length, radius, count=700):
    """The mantle of a cylinder along x."""
    x, angle = np.meshgrid((np.arange(count) + 0.5) / count - 0.5, 2 * np.pi * (np.arange(count) + 0.5) / count)
    x, angle = x.ravel(), angle.ravel()
    normals = np.stack([0 * x, np.cos(angle), np.sin(angle)], -1)
    points = np.stack([length * x, radius * normals[:, 1], radius * normals[:, 2]], -1)
    return points, normals, np.full(x.size, 2 * np.pi * radius * length / x.size)


def moved(pieces, R, t):
    """Pieces turned by R (3, 3), then moved by t (3,)."""
    points, normals, areas = pieces
    return points @ R.T + t, normals @ R.T, areas


def shaping(axis, *, cone=180.0, softness=0.0, focus=0.0):
    """What UsdLux.ShapingAPI multiplies the emission by, for unit directions (N, 3); cone in degrees."""

    def factor(directions):
        cosine = directions @ unit(axis)
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        if softness:
            x = np.clip((angle - cone * (1 - softness)) / (cone * softness), 0, 1)
            faded = 1 - x * x * (3 - 2 * x)
        else:
            faded = angle <= cone
        return faded * np.abs(cosine) ** focus

    return factor
