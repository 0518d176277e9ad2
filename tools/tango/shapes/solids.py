"""Solids with flat faces: boxes, prisms, trays, bars; each function returns one closed Shape."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from tango.shapes.bevel import EDGE, bevelled
from tango.shapes.shape import Face, Point, Shape, split, surface


def box(low: Point, high: Point, material: str, *, bevel: float = EDGE, keep: Collection[int] = ()) -> Shape:
    """A box between two corners, its edges cut by `bevel`; corners are numbered around the bottom, then the top."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return prism([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1, material, bevel=bevel, keep=keep)


def prism(
    outline: Sequence[tuple[float, float]],
    z0: float,
    z1: float,
    material: str,
    *,
    bevel: float = EDGE,
    keep: Collection[int] = (),
) -> Shape:
    """A convex outline (counter-clockwise in x, y) extruded from z0 to z1, its edges cut by `bevel`."""
    n = len(outline)
    points = np.array([(x, y, z) for z in (z0, z1) for x, y in outline], float)
    sides: list[Face] = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    faces = [tuple(range(n))[::-1], tuple(range(n, 2 * n)), *sides]
    return bevelled(points, faces, [material] * len(faces), bevel, keep=keep)


def slab(outline: Sequence[tuple[float, float]], z0: float, z1: float, material: str, *, bevel: float = EDGE) -> Shape:
    """A flat piece on something: a convex outline at z0, which is sunk into it, narrower by `bevel` at z1.

    Few faces do for its many copies. Its sides' normals turn from outwards to upwards, as those of a rounded edge do.
    """
    n = len(outline)
    base = np.array(outline, float)
    towards = np.roll(base, -1, axis=0) - base
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    back = -np.roll(towards, 1, axis=0)
    sine = towards[:, 0] * back[:, 1] - towards[:, 1] * back[:, 0]
    top = base + bevel * (towards + back) / sine[:, None]
    points = np.concatenate([np.column_stack([ring, np.full(n, z)]) for ring, z in ((base, z0), (top, z1))])
    sides = [(i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n)]
    caps = [*split(tuple(range(n))[::-1]), *split(tuple(range(n, 2 * n)))]
    shape = surface(points, [*sides, *caps], material, crease=1.0)
    normals = shape.normals.copy()
    normals[: 4 * n].reshape(n, 4, 3)[:, :2] = np.column_stack([towards[:, 1], -towards[:, 0], np.zeros(n)])[:, None]
    normals[: 4 * n].reshape(n, 4, 3)[:, 2:] = (0.0, 0.0, 1.0)
    return replace(shape, normals=normals)


def tray(low: Point, high: Point, rim: float, depth: float, rim_material: str, floor_material: str) -> Shape:
    """A box whose top is lowered by `depth` inside a rim of this width; its four top corners stay where they are."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    outer = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    inner = [(x0 + rim, y0 + rim), (x1 - rim, y0 + rim), (x1 - rim, y1 - rim), (x0 + rim, y1 - rim)]
    levels = [(outer, z0), (outer, z1), (inner, z1), (inner, z1 - depth)]
    points = np.array([(x, y, z) for outline, z in levels for x, y in outline])
    walls = [
        (4 * k + i, 4 * k + (i + 1) % 4, 4 * k + 4 + (i + 1) % 4, 4 * k + 4 + i) for k in range(3) for i in range(4)
    ]
    materials = [rim_material] * 12 + [floor_material] * 2
    return bevelled(points, [*walls, (3, 2, 1, 0), (12, 13, 14, 15)], materials, EDGE, keep=range(4, 8))


def strut(start: Point, end: Point, across: Point, width: float, thickness: float, material: str) -> Shape:
    """A flat bar from start to end, half a width longer at both ends, its thickness along `across`, from 0 to +1."""
    along = np.subtract(end, start)
    length = float(np.linalg.norm(along))
    x, z = along / length, np.array(across, float)
    bar = box((-width / 2, -width / 2, 0.0), (length + width / 2, width / 2, thickness), material)
    return bar.moved(start, np.stack([x, np.cross(z, x), z], axis=1))
