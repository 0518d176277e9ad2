"""Multi-layer insulation: a box of crumpled foil, sewn together from pieces."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tango.shapes.crumple import fraction, heights
from tango.shapes.shape import Array, Face, Point, Shape, surface

Node: TypeAlias = tuple[int, int, int]
Numbers: TypeAlias = NDArray[np.int_]  # nodes, (N, 3)
Wall: TypeAlias = tuple[int, int]  # the axis that it looks along, and 0 or 1: backwards or forwards

CREASE = 25.0  # degrees; foil bends smoothly, and its fine creases are a texture
SLIDE = 0.5  # how far a node may wander within its cell


@dataclass(frozen=True, kw_only=True)
class Blanket:
    """A box of foil. Inner points of its walls stand out by up to `depth`.

    seams: for each axis, where seams cross the walls · buttons: the places that hold the foil down · plain: walls that
    nobody sees; they stay flat, a fan from their rim to their middle. The pattern is a hash of each point's place.
    """

    low: Point
    high: Point
    cell: float
    depth: float
    material: str
    seams: tuple[Sequence[float], Sequence[float], Sequence[float]] = ((), (), ())
    buttons: Sequence[Point] = ()
    plain: Collection[Wall] = ()

    def shape(self) -> Shape:
        """The whole box; each piece between seams has the texture at a place and an angle of its own."""
        places: dict[Node, int] = {}
        faces: list[Face] = []
        for axis in range(3):
            for side in (0, 1):
                find = self._fan if (axis, side) in self.plain else self._grid
                for nodes in find(axis, side):
                    faces.append(tuple(places.setdefault(node, len(places)) for node in nodes[:: 1 if side else -1]))
        numbers = np.array(list(places))
        flat = self._flat(numbers)
        whole = surface(self._crumpled(numbers, flat), faces, self.material, crease=CREASE)
        return replace(whole, st=np.concatenate([self._cut(flat[list(face)]) for face in faces]))

    @cached_property
    def _ticks(self) -> list[Array]:
        """Where the grid's planes cross each axis: every seam is one of them."""
        ticks = []
        for low, high, seams in zip(self.low, self.high, self.seams, strict=True):
            ends = [low, *seams, high]
            pieces = [np.linspace(a, b, max(1, round((b - a) / self.cell)), endpoint=False) for a, b in pairwise(ends)]
            ticks.append(np.concatenate([*pieces, [high]]))
        return ticks

    def _node(self, axis: int, side: int, u: int, v: int) -> Node:
        at = np.zeros(3, int)
        at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3] = side * (len(self._ticks[axis]) - 1), u, v
        return int(at[0]), int(at[1]), int(at[2])

    def _counts(self, axis: int) -> tuple[int, int]:
        ticks = self._ticks
        return len(ticks[(axis + 1) % 3]) - 1, len(ticks[(axis + 2) % 3]) - 1

    def _grid(self, axis: int, side: int) -> Iterator[list[Node]]:
        """Two triangles a cell, counter-clockwise seen along the axis; which diagonal they share is up to the hash."""
        for u, v in np.ndindex(*self._counts(axis)):
            a, b, c, d = (self._node(axis, side, u + p, v + q) for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
            yield from ([[a, b, c], [a, c, d]] if fraction(*a, 4) < 0.5 else [[b, c, d], [b, d, a]])

    def _fan(self, axis: int, side: int) -> Iterator[list[Node]]:
        m, n = self._counts(axis)
        rim = [(u, 0) for u in range(m)] + [(m, v) for v in range(n)]
        rim += [(m - u, n) for u in range(m)] + [(0, n - v) for v in range(n)]
        middle = self._node(axis, side, m // 2, n // 2)
        for p, q in zip(rim, rim[1:] + rim[:1], strict=True):
            yield [middle, self._node(axis, side, *p), self._node(axis, side, *q)]

    def _flat(self, nodes: Numbers) -> Array:
        """Places (N, 3) before the foil is crumpled, the inner ones of a wall a little aside from the grid."""
        ticks = self._ticks
        place = np.stack([line[nodes[:, axis]] for axis, line in enumerate(ticks)], axis=-1)
        for axis, (line, seams) in enumerate(zip(ticks, self.seams, strict=True)):
            free = ~np.isin(place[:, axis], [line[0], line[-1], *seams])
            aside = np.array([fraction(*node, axis) - 0.5 for node in nodes.tolist()])
            place[free, axis] += (SLIDE * self.cell * aside)[free]
        return place

    def _crumpled(self, nodes: Numbers, flat: Array) -> Array:
        """The places (N, 3), each inner one of a wall that is not plain pushed outwards."""
        points, last = flat.copy(), np.array([len(line) - 1 for line in self._ticks])
        inner = ((nodes > 0) & (nodes < last)).sum(axis=1) == 2
        for axis in range(3):
            for side in (0, 1):
                on = inner & (nodes[:, axis] == side * last[axis])
                if on.any() and (axis, side) not in self.plain:
                    rise = self._rise(flat[on], axis, 2 * axis + side)
                    points[on, axis] += (2 * side - 1) * self.depth * rise
        return points

    def _rise(self, at: Array, axis: int, seed: int) -> Array:
        """Heights (N,) over one wall, low along its edges and seams and around its buttons."""
        others = [i for i in range(3) if i != axis]
        lines = [(i, s) for i in others for s in (*self.seams[i], self.low[i], self.high[i])]
        held = [np.abs(at[:, i] - s) for i, s in lines]
        held += [np.linalg.norm(at - button, axis=1) for button in np.array(self.buttons, float).reshape(-1, 3)]
        return heights(at[:, others], seed, held)

    def _cut(self, polygon: Array) -> Array:
        """st of a face's corners (K, 2): the piece of foil it belongs to was cut from the roll at some place and
        angle, so that no piece looks like another."""
        middle = polygon.mean(axis=0)
        piece = [int(np.searchsorted(seams, m)) for seams, m in zip(self.seams, middle, strict=True)]
        axis = int(np.abs(_normal(polygon)).argmax())
        label = (axis, int(middle[axis] > (self.low[axis] + self.high[axis]) / 2), *piece[:axis], *piece[axis + 1 :])
        angle = 2 * np.pi * fraction(*label, 1)
        c, s = np.cos(angle), np.sin(angle)
        flat = np.delete(polygon, axis, axis=1)
        return np.asarray(flat @ np.array([[c, s], [-s, c]]) + [fraction(*label, 2), fraction(*label, 3)])


def _normal(polygon: Array) -> Array:
    return np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0])
