"""Cables: round, bent through given points, tied and taped down; and the connectors that they end in."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from tango.shapes.shape import Array, Face, Point, Shape, split, surface

SIDES = 6
STEP = 0.018  # metres between two rings of a cable


def cable(through: Sequence[Point], radius: float, material: str, *, sides: int = SIDES) -> Shape:
    """A round cable that bends smoothly through these points; st is (arc, length), in metres."""
    path = smooth(through)
    rings = np.arange(len(path) * sides).reshape(len(path), sides)
    around = 2 * np.pi * np.arange(sides) / sides
    circle = radius * np.stack([np.cos(around), np.sin(around)], axis=-1)
    points = np.concatenate([place + circle @ axes for place, axes in zip(path, _axes(path), strict=True)])
    faces: list[Face] = []
    for lower, upper in zip(rings[:-1].tolist(), rings[1:].tolist(), strict=True):
        faces += [(lower[i], lower[i - sides + 1], upper[i - sides + 1], upper[i]) for i in range(sides)]
    caps = [tuple(rings[0].tolist())[::-1], tuple(rings[-1].tolist())]
    return surface(points, [*faces, *(piece for cap in caps for piece in split(cap))], material, crease=65.0)


def ties(through: Sequence[Point], radius: float, every: float, material: str) -> Iterator[Shape]:
    """Short sleeves around a cable, one for `every` metres: cable ties."""
    path = smooth(through)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    for at in np.arange(every / 2, along[-1], every):
        ends = [[np.interp(at + s, along, axis) for axis in path.T] for s in (-0.0015, 0.0015)]
        yield cable(ends, radius + 0.0007, material, sides=SIDES)


def smooth(through: Sequence[Point]) -> Array:
    """A curve (N, 3) through the points, about STEP from one to the next."""
    given = np.array(through, float)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(given, axis=0), axis=1))])
    count = max(2, int(np.ceil(along[-1] / STEP)) + 1)
    if len(given) == 2:
        return np.linspace(given[0], given[1], 2)
    at = np.unique(np.concatenate([along[1:-1], np.linspace(0.0, along[-1], count)]))
    keep = np.concatenate([[True], np.diff(at) > 0.3 * STEP])
    keep[-1] = True
    curve: Array = CubicSpline(along, given)(at[keep])
    return curve


def _axes(path: Array) -> Iterator[Array]:
    """For each place two directions across the curve (2, 3) that do not twist along it."""
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along[0], np.eye(3)[np.abs(along[0]).argmin()])
    for direction in along:
        across = across - (across @ direction) * direction
        across /= np.linalg.norm(across)
        yield np.stack([across, np.cross(direction, across)])
