"""Looking up latitude-longitude images, fast: bilinear between the centres of texels, in float32."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.renderers.background.planet.elementary import Float32
from spin_usd.scene.texture import Image

TAU = np.float32(2 * np.pi)


@lru_cache(maxsize=8)
def planes(image: Image) -> Float32:
    """Return (4, H + 1, W + 1): the channels apart, so that looking up each of them is contiguous; the first column and
    the last row again at the end, so that a place between the last two needs no wrapping."""
    return repeated(np.moveaxis(image.pixels, -1, 0))


def repeated(tables: Float32) -> Float32:
    """`tables` (C, H, W) with the first column and the last row again at the end."""
    wide = np.concatenate([tables, tables[:, :, :1]], axis=2)
    return np.ascontiguousarray(np.concatenate([wide, wide[:, -1:]], axis=1))


def bilinear_latlong(tables: Float32, longitude: Float32, latitude: Float32) -> list[Float32]:
    """Return (N,) of each of the repeated `tables` at longitudes and latitudes (N,), radians; longitude 0 is their
    middle."""
    height, width = tables.shape[1] - 1, tables.shape[2] - 1
    x = longitude * (width / TAU) + np.float32(width / 2 - 0.5)
    y = latitude * np.float32(-height / np.pi) + np.float32(height / 2 - 0.5)
    x -= np.floor(x * np.float32(1 / width)) * np.float32(width)
    return bilinear(tables, np.minimum(x, np.float32(width)), np.clip(y, 0, height - 1))


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
