"""A part of a picture in its own size, as the input of a network.

Pixel coordinates have (0, 0) at the corner of the image, so scaling is about that corner, and no half pixel is lost: u'
= (u - x0) * size / width.
"""

from dataclasses import dataclass
from math import ceil, floor
from numbers import Real
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError
from spin_usd.formats.image_file import resampled
from spin_usd.geometry.camera import Camera

MAX_MARGIN = 100  # of the box: more is memory for nothing
MAX_SIDE = 2**14  # pixels
BETWEEN = 1e-9  # pixels: so near to the border of two, a centre lies on it but for rounding


@dataclass(frozen=True, kw_only=True)
class Window:
    """A part of an image, and its new size.

    `x0`, `y0`, `width` and `height` are pixels of the image. The part may reach beyond its edges, where all is 0.
    """

    x0: float
    y0: float
    width: float
    height: float
    size: tuple[int, int]
    """Width and height in pixels of its own."""

    @classmethod
    def whole(cls, camera: Camera, size: tuple[int, int]) -> Self:
        """Return the whole frame of the camera in that size."""
        return cls(x0=0.0, y0=0.0, width=float(camera.width), height=float(camera.height), size=size)

    @classmethod
    def around(cls, box: Float, size: tuple[int, int], *, margin: float) -> Self:
        """Return the least window of the form of `size` around the middle of the `box` (4,) x0, y0, x1, y1 that leaves
        that share of the box's sides free, half of it on each side."""
        x0, y0, x1, y1 = box.tolist()
        scale = max((x1 - x0) / size[0], (y1 - y0) / size[1]) * (1 + margin)
        width, height = scale * size[0], scale * size[1]
        return cls(x0=(x0 + x1 - width) / 2, y0=(y0 + y1 - height) / 2, width=width, height=height, size=size)

    @property
    def scale(self) -> Float:
        """How many of its pixels (2,) lie along one of the image's."""
        return np.divide(self.size, (self.width, self.height))

    def of(self, outer: "Window | None") -> "Window":
        """Return this window of the `outer` one as a window of the whole image."""
        if outer is None:
            return self
        x, y = outer.scale.tolist()
        return Window(
            x0=outer.x0 + self.x0 / x,
            y0=outer.y0 + self.y0 / y,
            width=self.width / x,
            height=self.height / y,
            size=self.size,
        )

    def camera(self, camera: Camera) -> Camera:
        """Return the camera whose whole frame this window is."""
        x, y = self.scale.tolist()
        return Camera(
            width=self.size[0],
            height=self.size[1],
            fx=camera.fx * x,
            fy=camera.fy * y,
            cx=(camera.cx - self.x0) * x,
            cy=(camera.cy - self.y0) * y,
            distortion=camera.distortion,
        )

    def pixels(self, uv: Float) -> Float:
        """Return (..., 2) in the window of the image's pixel coordinates (..., 2)."""
        return (uv - (self.x0, self.y0)) * self.scale

    def rows(self, height: int) -> range:
        """Return the rows that it needs of an image with that number of rows."""
        return _needed(self.y0, self.height, self.size[1], height)

    def columns(self, width: int) -> range:
        """Return the columns that it needs of an image with that number of columns."""
        return _needed(self.x0, self.width, self.size[0], width)

    def cut(self, array: NDArray[Any], top: int, *, smooth: bool) -> NDArray[Any]:
        """Return the window of an image whose rows from `top` on are the `array` (rows, W) or (rows, W, C).

        smooth: each pixel is a mean of those around its centre, as by `resampled`; else the image's pixel in which its
        centre lies; between two, each in turn.
        """
        return self._smooth(array, top) if smooth else self._nearest(array, top)

    def _nearest(self, array: NDArray[Any], top: int) -> NDArray[Any]:
        columns = _holding(self.x0, self.width, self.size[0])
        rows = _holding(self.y0, self.height, self.size[1]) - top
        inside_x, inside_y = ((at >= 0) & (at < n) for at, n in ((columns, array.shape[1]), (rows, array.shape[0])))
        found = np.zeros((self.size[1], self.size[0], *array.shape[2:]), array.dtype)
        found[np.ix_(inside_y, inside_x)] = array[np.ix_(rows[inside_y], columns[inside_x])]
        return found

    def _smooth(self, array: NDArray[Any], top: int) -> NDArray[Any]:
        height, width = array.shape[:2]
        x0, y0 = self.x0, self.y0 - top
        before = (max(ceil(-y0), 0), max(ceil(-x0), 0))
        after = (max(ceil(y0 + self.height) - height, 0), max(ceil(x0 + self.width) - width, 0))
        edges = list(zip(before, after, strict=True))
        layers = np.pad(array.reshape(height, width, -1), [*edges, (0, 0)]).astype(np.float32)
        box = (x0 + before[1], y0 + before[0], x0 + before[1] + self.width, y0 + before[0] + self.height)
        made = [resampled(layer, box, self.size) for layer in np.moveaxis(layers, 2, 0)]
        found = np.stack(made, -1).reshape(self.size[1], self.size[0], *array.shape[2:])
        return np.rint(found).astype(array.dtype) if array.dtype.kind in "ui" else found.astype(array.dtype)


def _needed(start: float, length: float, count: int, there: int) -> range:
    """Return the part needed along a side that has `there` pixels."""
    reach = max(length / count, 1)  # of the filter, beyond the window
    first, last = floor(start - reach), ceil(start + length + reach)
    return range(min(max(first, 0), there - 1), min(max(last, 1), there))


def _holding(start: float, length: float, count: int) -> NDArray[np.int64]:
    """Return (count,) the pixels that hold the centres of `count` along a side. Where a centre lies between two, as
    where a size is halved, it is the one and the other in turn: always the same one would move all by half a pixel."""
    at = start + (np.arange(count) + 0.5) * (length / count)
    between = np.abs(at - np.rint(at)) < BETWEEN
    found: NDArray[np.int64] = np.where(between, np.rint(at) - np.arange(count) % 2, np.floor(at)).astype(np.int64)
    return found


def size_of(size: int | tuple[int, int]) -> tuple[int, int]:
    """Return width and height of a `size`, one number for a square. Raises InputError."""
    sides = tuple(size) if isinstance(size, tuple | list) else (size, size)
    if len(sides) != 2 or not all(isinstance(side, int | np.integer) and 1 <= side <= MAX_SIDE for side in sides):
        raise InputError(
            f"pictures cannot be of size {size!r}", do=f"give one side, or (width, height), 1 to {MAX_SIDE}"
        )
    return int(sides[0]), int(sides[1])


def margin_of(margin: float) -> float:
    """Return the `margin` of a crop, a share of the box's sides. Raises InputError."""
    if not (isinstance(margin, Real) and -1 < margin <= MAX_MARGIN):
        raise InputError(f"crops cannot have the margin {margin!r}", do="give a share of the box's sides, such as 0.1")
    return float(margin)
