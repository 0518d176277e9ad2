"""Bilinear interpolation between the points of a grid."""

from collections.abc import Sequence
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from spin_usd.renderers.background.elementary import Float32

Plane = TypeVar("Plane", NDArray[np.float32], NDArray[np.float64])
Cells = tuple[NDArray[np.intp], NDArray[np.intp]]
"""Rows and columns (N,) of the points of a grid at the top left of squares of four of them."""


def enlarged(values: Sequence[Plane], factor: int) -> list[Plane]:
    """Return each of `values` (R, C) interpolated bilinearly, `factor` steps from one point to the next.

    They come in arrays of their own: together they would be too large for memory that is had at once.
    """
    if factor == 1:
        return list(values)
    few = np.stack(values)
    count, rows, columns = few.shape
    step = few[..., 1:] - few[..., :-1]
    wide = np.empty((count, rows, (columns - 1) * factor + 1), few.dtype)
    wide[..., -1] = few[..., -1]
    between = step.repeat(factor, axis=-1) * _shares(factor, columns - 1)
    np.add(between, few[..., :-1].repeat(factor, axis=-1), out=wide[..., :-1])
    return [_lengthened(plane, factor) for plane in wide]


def in_cells(values: Sequence[Plane], cells: Cells, factor: int) -> list[Plane]:
    """Return each of `values` (R, C) interpolated bilinearly at `factor` by `factor` points of each of N `cells`, in
    their order: (N * factor * factor,)."""
    rows, columns = cells
    shares = np.arange(factor, dtype=np.float32) * np.float32(1 / factor)
    found = []
    for plane in values:
        a, b = plane[rows, columns, None], plane[rows, columns + 1, None]
        c, d = plane[rows + 1, columns, None], plane[rows + 1, columns + 1, None]
        top, bottom = (a + (b - a) * shares)[:, None], (c + (d - c) * shares)[:, None]
        found.append((top + (bottom - top) * shares[:, None]).ravel())
    return found


def _lengthened(values: Plane, factor: int) -> Plane:
    rows, columns = values.shape
    high = np.empty(((rows - 1) * factor + 1, columns), values.dtype)
    between = high[:-1].reshape(rows - 1, factor, columns)
    np.multiply((values[1:] - values[:-1])[:, None], _shares(factor, 1)[:, None], out=between)
    between += values[:-1, None]
    high[-1] = values[-1]
    return high


@lru_cache(maxsize=32)
def _shares(factor: int, times: int) -> Float32:
    """Return how far each of `factor` steps is on its way to the next point, repeated `times`."""
    return np.tile(np.arange(factor, dtype=np.float32) * np.float32(1 / factor), times)


def repeated(tables: Float32) -> Float32:
    """Return `tables` (C, H, W) with the first column and the last row again at the end."""
    wide = np.concatenate([tables, tables[:, :, :1]], axis=2)
    return np.ascontiguousarray(np.concatenate([wide, wide[:, -1:]], axis=1))


def bilinear(tables: Float32, x: Float32, y: Float32) -> list[Float32]:
    """Return (N,) of each of the repeated `tables`, whose own size is H, W, at column x from 0 to W and row y from 0 to
    H."""
    stride = tables.shape[2]
    column, row = x.astype(np.int32), y.astype(np.int32)
    np.minimum(column, stride - 2, out=column)
    np.minimum(row, tables.shape[1] - 2, out=row)
    fx, fy = x - column.astype(np.float32), y - row.astype(np.float32)
    corners = (row * stride + column).astype(np.intp)
    return [blended(table, stride, corners, fx, fy) for table in tables.reshape(len(tables), -1)]


def blended(table: Float32, stride: int, corners: NDArray[np.intp], fx: Float32, fy: Float32) -> Float32:
    """Return the flat `table`, whose rows are `stride` long, between the four entries of which the first are `corners`,
    `fx` of the way to the next column and `fy` of that to the next row."""
    a, b = table.take(corners, mode="clip"), table[1:].take(corners, mode="clip")
    c, d = table[stride:].take(corners, mode="clip"), table[stride + 1 :].take(corners, mode="clip")
    b -= a
    b *= fx
    a += b
    d -= c
    d *= fx
    c += d
    c -= a
    c *= fy
    a += c
    return a
