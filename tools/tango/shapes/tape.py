"""Tape: strips that lie over seams and hold cables, not quite straight and not quite flat."""

import numpy as np

from tango.shapes.crumple import fraction
from tango.shapes.shape import Array, Face, Point, Shape, surface

STEP = 0.024  # metres between two places where a strip bends
ASIDE, UNEVEN = 0.0007, 0.00035  # metres by which its edges and its surface wander


def tape(
    start: Point, end: Point, outwards: Point, width: float, height: float, *, sunk: float = 0.003, over: float = 0.0
) -> Shape:
    """A strip from start to end, its surface about `height` above that line and its edges `sunk` below it; `over` so
    much more in the middle, where a cable lies under it."""
    along = np.subtract(end, start)
    length = float(np.linalg.norm(along))
    frame = np.stack([along / length, np.cross(outwards, along / length), np.array(outwards, float)])
    share = np.linspace(0, 1, max(7 if over else 2, round(length / STEP) + 1))
    tops = height + over * np.cos(np.pi * (share - 0.5)) ** 4
    sections = [_section(length * s, k, width, top, sunk) for k, (s, top) in enumerate(zip(share, tops, strict=True))]
    points = np.concatenate(sections) @ frame + np.array(start, float)
    last = 4 * (len(sections) - 1)
    faces: list[Face] = [(0, 3, 2, 1), (last, last + 1, last + 2, last + 3)]
    for k in range(0, last, 4):
        faces += [(k + i, k + (i + 1) % 4, k + 4 + (i + 1) % 4, k + 4 + i) for i in range(4)]
    return surface(points, faces, "KaptonTape", crease=25.0)


def _section(at: float, number: int, width: float, height: float, sunk: float) -> Array:
    """Four points (along, across, up), counter-clockwise seen from the strip's end."""
    wander = [2 * fraction(number, round(1e5 * width), i, 7) - 1 for i in range(4)]
    low, high = -width / 2 + ASIDE * wander[0], width / 2 + ASIDE * wander[1]
    left, right = height + UNEVEN * wander[2], height + UNEVEN * wander[3]
    return np.array([(at, low, -sunk), (at, high, -sunk), (at, high, right), (at, low, left)])
