"""Bilinear interpolation in tables, in float32."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.renderers.background.elementary import Float32


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
