"""Multi-layer insulation: a box of crumpled foil."""

from collections.abc import Collection, Iterator
from typing import TypeAlias

import numpy as np

from tango.shape import Array, Face, Point, Shape, surface

Node: TypeAlias = tuple[int, int, int]

CREASE = 25.0  # degrees; foil bends smoothly, and its fine creases are a texture
SLIDE = 0.7  # how far a node may wander within its cell


def blanket(
    low: Point, high: Point, cell: float, depth: float, material: str, *, plain: Collection[tuple[int, int]] = ()
) -> Shape:
    """A closed box whose faces are grids of about `cell`, each inner node pushed outwards by 0 to `depth`.

    `plain` names faces (axis, 0 or 1) that nobody sees: they stay flat, a fan from their rim to their middle. The
    pattern is a hash of the node's place: the same on every machine.
    """
    size = np.array(high, float) - low
    counts = np.maximum(np.round(size / cell), 1).astype(int)
    places: dict[Node, int] = {}
    faces: list[Face] = []
    for axis in range(3):
        for side in (0, 1):
            find = _fan if (axis, side) in plain else _crumple
            for nodes in find(axis, side, counts):
                faces.append(tuple(places.setdefault(node, len(places)) for node in nodes[:: 1 if side else -1]))
    points = np.array([_place(node, counts, size, depth, plain) for node in places]) + low
    return surface(points, faces, material, crease=CREASE)


def _node(axis: int, side: int, counts: Array, u: int, v: int) -> Node:
    at = np.zeros(3, int)
    at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3] = side * counts[axis], u, v
    return int(at[0]), int(at[1]), int(at[2])


def _crumple(axis: int, side: int, counts: Array) -> Iterator[list[Node]]:
    """Two triangles a cell, counter-clockwise seen along the axis; which diagonal they share is up to the hash."""
    for u, v in np.ndindex(int(counts[(axis + 1) % 3]), int(counts[(axis + 2) % 3])):
        a, b, c, d = (_node(axis, side, counts, u + p, v + q) for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
        yield from ([[a, b, c], [a, c, d]] if _fraction(a, 4) < 0.5 else [[b, c, d], [b, d, a]])


def _fan(axis: int, side: int, counts: Array) -> Iterator[list[Node]]:
    m, n = int(counts[(axis + 1) % 3]), int(counts[(axis + 2) % 3])
    rim = [(u, 0) for u in range(m)] + [(m, v) for v in range(n)]
    rim += [(m - u, n) for u in range(m)] + [(0, n - v) for v in range(n)]
    middle = _node(axis, side, counts, m // 2, n // 2)
    for p, q in zip(rim, rim[1:] + rim[:1], strict=True):
        yield [middle, _node(axis, side, counts, *p), _node(axis, side, counts, *q)]


def _place(node: Node, counts: Array, size: Array, depth: float, plain: Collection[tuple[int, int]]) -> Array:
    at = np.array(node)
    place = at / counts * size
    walls = [(axis, int(at[axis] > 0)) for axis in range(3) if at[axis] in (0, counts[axis])]
    if len(walls) > 1 or walls[0] in plain:
        return place
    axis, side = walls[0]
    shift = np.array([_fraction(node, k) - 0.5 for k in range(3)]) * SLIDE * size / counts
    shift[axis] = (2 * side - 1) * depth * _fraction(node, 3)
    return place + shift


def _fraction(node: Node, salt: int) -> float:
    """A node scattered over 0 to 1 by a 32-bit multiply-and-shift hash."""
    number = node[0] * 73 + node[1] * 5179 + node[2] * 90283 + salt * 1009 + 1
    for _ in range(3):
        number = ((number >> 16) ^ number) * 0x45D9F3B & 0xFFFFFFFF
    return number / 0xFFFFFFFF
