"""Round solids: profiles turned about an axis; each function returns one closed Shape."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from tango.shapes.shape import Array, Face, Point, Shape, surface

Profile: TypeAlias = Sequence[tuple[float, float]]


def turned(profile: Profile, segments: int, material: str, *, ring: bool = False) -> Shape:
    """A profile of (radius, z), the material on its left, turned about z: from axis to axis, or a closed `ring`.

    st is (arc at the largest radius, length along the profile), in metres.
    """
    r, z = np.array(profile).T
    rows = len(profile) if ring else len(profile) - 1
    angle = 2 * np.pi * np.arange(segments) / segments
    grid = np.stack([np.outer(np.cos(angle), r), np.outer(np.sin(angle), r), np.tile(z, (segments, 1))], axis=-1)
    number = np.arange(grid[..., 0].size).reshape(segments, -1)
    number[:, r == 0] = number[0, r == 0]
    nodes = [node for i in range(segments) for k in range(rows) for node in _nodes(i, k, r)]
    used, packed = np.unique([number[i % segments, k % len(r)] for i, k in nodes], return_inverse=True)
    sizes = [len(_nodes(0, k, r)) for k in range(rows)] * segments
    st = np.array(nodes) @ np.diag([2 * np.pi * r.max() / segments, 0.0])
    st[:, 1] = _lengths(profile)[[k for _, k in nodes]]
    return surface(grid.reshape(-1, 3)[used], _split(packed.tolist(), sizes), material, st=st)


def rod(start: Point, end: Point, profile: Profile, segments: int, material: str) -> Shape:
    """`turned` with its axis from start towards end; z = 0 of the profile lies at start."""
    return turned(profile, segments, material).moved(start, frame(np.subtract(end, start)))


def frame(axis: Point) -> Array:
    """A rotation (3, 3) that takes +z to this axis; which way x then looks is arbitrary but fixed."""
    z = np.array(axis, float) / np.linalg.norm(axis)
    x = np.cross((0.0, 0.0, 1.0) if abs(z[2]) < 0.9 else (0.0, 1.0, 0.0), z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _nodes(i: int, k: int, r: Array) -> list[tuple[int, int]]:
    """The corners (segment, row) of one patch: four, or three where a row lies on the axis."""
    lower = [(i, k)] if r[k] == 0 else [(i, k), (i + 1, k)]
    upper = [(i, k + 1)] if r[(k + 1) % len(r)] == 0 else [(i + 1, k + 1), (i, k + 1)]
    return lower + upper


def _lengths(profile: Profile) -> Array:
    steps = np.diff([*profile, profile[0]], axis=0)
    return np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])


def _split(numbers: list[int], sizes: list[int]) -> list[Face]:
    ends = np.cumsum(sizes).tolist()
    return [tuple(numbers[end - size : end]) for size, end in zip(sizes, ends, strict=True)]
