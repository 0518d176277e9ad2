"""The radiance of a dome light behind everything."""

from functools import lru_cache

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.renderers.background.elementary import Float32, rotated
from spin_usd.renderers.background.enlarge import bilinear, repeated
from spin_usd.renderers.background.globe import Rays
from spin_usd.scene.light import DomeLight
from spin_usd.scene.texture import Image

TAU = np.float32(2 * np.pi)


def dome_radiance(dome: DomeLight, rays: Rays) -> list[Float32]:
    """Return R, G, B (N,), W/m2/sr, along the rays."""
    if dome.image is None:
        return [np.full_like(rays.length, channel) for channel in dome.radiance]
    longitude, latitude = _places(dome.T_cam_dome.rotation.T, rays)
    found = bilinear_latlong(planes(dome.image)[:3], longitude, latitude)
    return [channel * np.float32(scale) for channel, scale in zip(found, dome.radiance, strict=True)]


def _places(turn: Float, rays: Rays) -> tuple[Float32, Float32]:
    """Return longitude, to the right of the dome's -z, and latitude, toward its +y; (N,), radians."""
    x, y, z = (way.astype(np.float32) for way in rotated(turn, [rays.x, rays.y, rays.z]))
    return np.arctan2(x, -z), np.arctan2(y, np.sqrt(x * x + z * z))


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
