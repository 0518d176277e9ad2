"""Surfaces of revolution: an outline's sections rotated about z.

Round sections have 224 corners: a chord then stays within 1e-4 of the radius (1 - cos(pi / 224) = 9.8e-5), one
pixel in 10,000 across a radius. Between the corners of a sphere, which curves both ways, it is twice that.
"""

from itertools import pairwise

import numpy as np

from spin_usd.arrays import Float
from spin_usd.stage.read.shapes.triangles import Int, Triangles, unit

SEGMENTS = 224
Profile = list[tuple[Float, Float]]
"""Sections of an outline from bottom to top: points (K, 2) and normals (K, 2) as (distance from the axis, height)."""


def revolve(profile: Profile) -> Triangles:
    """Rotate an outline about z. Its sections meet at sharp edges; points on the axis are merged."""
    angle = np.arange(SEGMENTS) * (2 * np.pi / SEGMENTS)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1)
    points: list[Float] = []
    corners, normals = [], []
    base = 0
    for outline, directions in profile:
        points.append(_rotated(outline, ring).reshape(-1, 3))
        rotated = _rotated(directions, ring)
        for k, (low, high) in enumerate(pairwise(base + SEGMENTS * np.arange(len(outline)))):
            i, j = np.arange(SEGMENTS), (np.arange(SEGMENTS) + 1) % SEGMENTS
            corners += [np.stack([low + i, low + j, high + j], -1), np.stack([low + i, high + j, high + i], -1)]
            normals += [
                np.stack([rotated[k, i], rotated[k, j], rotated[k + 1, j]], 1),
                np.stack([rotated[k, i], rotated[k + 1, j], rotated[k + 1, i]], 1),
            ]
        base += SEGMENTS * len(outline)
    flat = np.concatenate(corners)
    return _welded(np.concatenate(points), flat, np.concatenate(normals))


def _welded(points: Float, corners: Int, normals: Float) -> Triangles:
    """Merge coincident points and drop triangles without area, so that the surface is closed."""
    unique, place = np.unique(points, axis=0, return_inverse=True)
    triangles = Triangles(
        points=unique,
        corners=place.reshape(-1)[corners].astype(np.int64),
        normals=unit(normals),
        source=np.zeros(len(corners), np.int64),
    )
    return triangles.with_area()


def _rotated(outline: Float, ring: Float) -> Float:
    """Rotate (distance, height) (K, 2) to points (K, SEGMENTS, 3); exactly on the axis where the distance is 0."""
    k, s = len(outline), len(ring)
    height = np.broadcast_to(outline[:, None, 1:], (k, s, 1))
    return np.concatenate([outline[:, None, :1] * ring + 0.0, height], -1)


def arc(radius: float, height: float, start: float, end: float) -> tuple[Float, Float]:
    """Make the section of a circle around (0, height) from the angle `start` to `end`, radians from the equator."""
    steps = int(np.ceil(SEGMENTS * (end - start) / (2 * np.pi) - 1e-9))
    angle = np.linspace(start, end, steps + 1)
    normal = np.stack([np.where(np.isclose(abs(angle), np.pi / 2), 0, np.cos(angle)), np.sin(angle)], -1)
    return radius * normal + [0, height], normal


def side(r0: float, z0: float, r1: float, z1: float) -> tuple[Float, Float]:
    """Make the straight section from (r0, z0) to (r1, z1)."""
    normal = unit(np.array([z1 - z0, r0 - r1, 0.0]))[:2]
    return np.array([[r0, z0], [r1, z1]]), np.array([normal, normal])


def disc(radius: float, height: float, up: int) -> tuple[Float, Float]:
    """Make the section of a flat disc that faces up (1) or down (-1)."""
    outline = np.array([[0.0, height], [radius, height]])
    return (outline if up < 0 else outline[::-1]), np.array([[0.0, up], [0.0, up]])
