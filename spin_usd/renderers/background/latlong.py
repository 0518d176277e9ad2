"""Looking up latitude-longitude images, fast: bilinear between the centres of texels, in float32."""

from functools import lru_cache

import numpy as np

from spin_usd.renderers.background.bilinear import bilinear, repeated
from spin_usd.renderers.background.elementary import Float32
from spin_usd.scene.texture import Image

TAU = np.float32(2 * np.pi)


@lru_cache(maxsize=8)
def planes(image: Image) -> Float32:
    """Return (4, H + 1, W + 1): the channels apart, so that looking up each of them is contiguous; the first column and
    the last row again at the end, so that a place between the last two needs no wrapping."""
    return repeated(np.moveaxis(image.pixels, -1, 0))


def bilinear_latlong(tables: Float32, longitude: Float32, latitude: Float32) -> list[Float32]:
    """Return (N,) of each of the repeated `tables` at longitudes and latitudes (N,), radians; longitude 0 is their
    middle."""
    height, width = tables.shape[1] - 1, tables.shape[2] - 1
    x = longitude * (width / TAU) + np.float32(width / 2 - 0.5)
    y = latitude * np.float32(-height / np.pi) + np.float32(height / 2 - 0.5)
    x -= np.floor(x * np.float32(1 / width)) * np.float32(width)
    return bilinear(tables, np.minimum(x, np.float32(width)), np.clip(y, 0, height - 1))
