"""Screws, rivets and the buttons that hold blankets: heads on a wall, a hundred of them."""

from collections.abc import Iterable, Iterator

import numpy as np

from tango.shapes.shape import Array, Point, Shape
from tango.shapes.solids import slab
from tango.shapes.turned import frame


def polygon(radius: float, sides: int) -> list[tuple[float, float]]:
    """A regular outline, counter-clockwise."""
    angle = 2 * np.pi * np.arange(sides) / sides
    return [(float(x), float(y)) for x, y in zip(radius * np.cos(angle), radius * np.sin(angle), strict=True)]


def head(radius: float, height: float, material: str, *, sides: int = 6, sunk: float = 0.00113) -> Shape:
    """One head on the plane z = 0, sunk into what it holds."""
    return slab(polygon(radius, sides), -sunk, height, material, bevel=0.25 * radius)


def heads(places: Iterable[Point], towards: Point, shape: Shape) -> Iterator[Shape]:
    """Copies of a head at these places, looking along `towards`; each is turned its own way."""
    upright = frame(towards)
    for number, place in enumerate(places):
        c, s = np.cos(number * 2.4), np.sin(number * 2.4)
        yield shape.moved(place, upright @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def row(start: Point, end: Point, count: int) -> Array:
    """`count` places (N, 3) from start to end."""
    return np.linspace(start, end, count)
