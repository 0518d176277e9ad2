"""Vignetting: the share of light that reaches a pixel, 1 on the optical axis."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import frozen
from spin_usd.geometry.camera import Camera
from spin_usd.scene.photometry.vignetting import polynomial_gain
from spin_usd.scene.sensor import Optics


def vignetting_gain(camera: Camera, optics: Optics) -> NDArray[np.float32] | None:
    """Return (H, W) the gain at each pixel's centre, read-only; None where it is 1 throughout."""
    if not (optics.cos_fourth or any(optics.vignetting)):
        return None
    return _gain(camera, optics.cos_fourth, optics.vignetting)


@lru_cache(maxsize=2)
def _gain(camera: Camera, cos_fourth: bool, coefficients: tuple[float, float, float]) -> NDArray[np.float32]:
    gain = np.ones(camera.frame.shape)
    if cos_fourth:  # of the angle to the axis of the true ray, before the lens distorted it
        xy = camera.centres(camera.frame)
        gain /= (1 + xy[..., 0] ** 2 + xy[..., 1] ** 2) ** 2
    if any(coefficients):
        v, u = np.indices(gain.shape) + 0.5
        gain *= polynomial_gain(camera, coefficients, np.stack([u, v], -1))
    return frozen(gain, np.float32)
