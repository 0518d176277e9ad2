"""Closed solids of polygons: boxes, prisms, lathes, tubes and cushions, in metres."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from spin_usd.basics.arrays import Float

Faces = tuple[tuple[int, ...], ...]
Point: TypeAlias = Sequence[float] | Float
DECIMALS = 6  # micrometres: the same bytes on every machine, whatever the last digit of its sine


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid:
    """A closed surface of polygons, counter-clockwise from outside."""

    points: Float
    """(P, 3) metres."""
    faces: Faces
    """Point indices of each face."""
    materials: tuple[str, ...]
    """(F,) names of the library's materials."""
    smooth: bool = False
    """True where the faces stand for a curved surface."""

    @property
    def fans(self) -> Iterator[tuple[tuple[int, ...], int]]:
        """Yield the triangles of its faces: the face, and the place of the second corner in it; the first is 0."""
        return ((face, i) for face in self.faces for i in range(1, len(face) - 1))

    def placed(self, axes: Float, at: Float) -> "Solid":
        """Return the solid in other axes: `axes` (3, 3) has its x, y and z as columns, `at` (3,) is its origin."""
        return replace(self, points=self.points @ np.asarray(axes).T + at)

    def with_material(self, material: str, *faces: int) -> "Solid":
        """Return the solid with another material on these faces."""
        return replace(self, materials=tuple(material if i in faces else each for i, each in enumerate(self.materials)))


FRONT = 5  # of a box's faces, -x +x -y +y -z +z
_BOX: Faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def box(low: Point, high: Point, material: str) -> Solid:
    """Return a box from one corner to the opposite one."""
    both = np.array([low, high])
    corners = np.stack(np.meshgrid(*both.T, indexing="ij"), -1).reshape(-1, 3)
    return Solid(points=corners, faces=_BOX, materials=(material,) * 6)


def block(centre: Point, size: Point, material: str) -> Solid:
    """Return a box by its centre and its edges."""
    middle, half = np.asarray(centre, float), np.asarray(size, float) / 2
    return box((middle - half).tolist(), (middle + half).tolist(), material)


def lathe(profile: Sequence[tuple[float, float]], material: str, sides: int = 32, *, smooth: bool = True) -> Solid:
    """Return the solid that a profile of radius and z sweeps around z.

    The profile goes outward at its lowest end and up. If it begins and ends on the axis it is a bulb; otherwise its
    ends are joined, and it is a ring.
    """
    angles = 2 * np.pi * np.arange(sides) / sides
    open_ends = profile[0][0] == 0 and profile[-1][0] == 0
    rings = profile[1:-1] if open_ends else profile
    points = [(r * np.cos(a), r * np.sin(a), z) for r, z in rings for a in angles]
    pairs = list(zip(range(len(rings) - 1), range(1, len(rings)), strict=True))
    if not open_ends:
        pairs.append((len(rings) - 1, 0))
    turn = [(i, (i + 1) % sides) for i in range(sides)]
    faces = [(a * sides + i, a * sides + j, b * sides + j, b * sides + i) for a, b in pairs for i, j in turn]
    if open_ends:
        low, high = len(points), len(points) + 1
        points += [(0.0, 0.0, profile[0][1]), (0.0, 0.0, profile[-1][1])]
        last = (len(rings) - 1) * sides
        faces_of_poles = [(low, j, i) for i, j in turn] + [(high, last + i, last + j) for i, j in turn]
        return Solid(
            points=np.array(points),
            faces=(*faces, *faces_of_poles),
            materials=(material,) * (len(faces) + 2 * sides),
            smooth=smooth,
        )
    return Solid(points=np.array(points), faces=tuple(faces), materials=(material,) * len(faces), smooth=smooth)


def cylinder(radius: float, low: float, high: float, material: str, sides: int = 32) -> Solid:
    """Return a cylinder along z."""
    return lathe([(0, low), (radius, low), (radius, high), (0, high)], material, sides)


def ring(inner: float, outer: float, low: float, high: float, material: str, sides: int = 32) -> Solid:
    """Return a ring of rectangular section around z."""
    return lathe([(inner, low), (outer, low), (outer, high), (inner, high)], material, sides)


def prism(sides: int, radius: float, low: float, high: float, material: str) -> Solid:
    """Return a prism along z, whose side faces are `radius` from its axis and come first; the first faces +x."""
    angles = (2 * np.pi * np.arange(sides) - np.pi) / sides
    out = radius / np.cos(np.pi / sides)
    rings = [np.stack([out * np.cos(angles), out * np.sin(angles), np.full(sides, z)], 1) for z in (low, high)]
    around = tuple((i, (i + 1) % sides, sides + (i + 1) % sides, sides + i) for i in range(sides))
    ends = (tuple(range(sides - 1, -1, -1)), tuple(range(sides, 2 * sides)))
    return Solid(points=np.concatenate(rings), faces=(*around, *ends), materials=(material,) * (sides + 2))


def tube(path: Sequence[Point] | Float, radius: float, material: str, sides: int = 8) -> Solid:
    """Return a round rod along a polyline of (3,) points, mitred at its bends."""
    points = np.asarray(path, float)
    steps = np.diff(points, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    across = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    angles = 2 * np.pi * np.arange(sides) / sides
    axes = upright(steps[0])
    circle = radius * (np.outer(np.cos(angles), axes[:, 0]) + np.outer(np.sin(angles), axes[:, 1]))
    rings = []
    for i, (point, normal) in enumerate(zip(points, across, strict=True)):
        before, after = steps[max(i - 1, 0)], steps[min(i, len(steps) - 1)]
        ring_here = circle - np.outer(circle @ normal, before) / (before @ normal)
        circle = ring_here - np.outer(ring_here @ after, after)
        rings.append(point + ring_here)
    turn = [(i, (i + 1) % sides) for i in range(sides)]
    around = [
        (a * sides + i, a * sides + j, (a + 1) * sides + j, (a + 1) * sides + i)
        for a in range(len(rings) - 1)
        for i, j in turn
    ]
    last = (len(rings) - 1) * sides
    ends = [tuple(range(sides - 1, -1, -1)), tuple(range(last, last + sides))]
    faces: Faces = (*around, *ends)
    return Solid(points=np.concatenate(rings), faces=faces, materials=(material,) * len(faces), smooth=True)


def rod(start: Point, end: Point, radius: float, material: str, sides: int = 12) -> Solid:
    """Return a straight rod."""
    return tube((start, end), radius, material, sides)


def cushion(low: Point, high: Point, bulge: float, material: str, cells: int = 8) -> Solid:
    """Return a box whose faces bulge outward by `bulge` in their middles, as foil over it does, and not at edges."""
    s = np.linspace(-1, 1, cells + 1)
    u, v = (each.ravel() for each in np.meshgrid(s, s, indexing="ij"))
    height = bulge * (1 - u**2) * (1 - v**2)
    middle, half = (np.asarray(high) + np.asarray(low)) / 2, (np.asarray(high) - np.asarray(low)) / 2
    points: list[Float] = []
    faces = []
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1).reshape(-1, 4)
    for axis in range(3):
        for sign in (-1, 1):
            a, b = ((axis + 1) % 3, (axis + 2) % 3) if sign > 0 else ((axis + 2) % 3, (axis + 1) % 3)
            face = np.empty((len(u), 3))
            face[:, axis] = sign * (half[axis] + height)
            face[:, a], face[:, b] = u * half[a], v * half[b]
            faces.append(quads + len(points) * len(u))
            points.append(middle + face)
    merged, of = np.unique(np.round(np.concatenate(points), DECIMALS), axis=0, return_inverse=True)
    found: Faces = tuple(tuple(each) for each in of.ravel()[np.concatenate(faces)].tolist())
    return Solid(points=merged, faces=found, materials=(material,) * len(found), smooth=True)


def upright(direction: Point) -> Float:
    """Return axes (3, 3), as columns, whose z is along `direction`."""
    z = np.asarray(direction, float) / np.linalg.norm(direction)
    x = np.eye(3)[int(np.abs(z).argmin())]
    x = x - z * (x @ z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)
