"""The radiance of a dome light behind everything."""

import numpy as np

from spin_usd.arrays import Float
from spin_usd.renderers.background.elementary import Float32, rotated
from spin_usd.renderers.background.globe import Rays
from spin_usd.renderers.background.latlong import bilinear_latlong, planes
from spin_usd.scene.light import DomeLight


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
