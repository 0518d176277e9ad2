"""Vignetting: the share of light that reaches a pixel, 1 on the optical axis."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float, frozen
from spin_usd.geometry.camera import Camera
from spin_usd.scene.sensor import Optics


def vignetting_gain(camera: Camera, optics: Optics) -> NDArray[np.float32] | None:
    """(H, W) the gain at each pixel's centre, read-only; None where it is 1 throughout."""
    if not (optics.cos_fourth or any(optics.vignetting)):
        return None
    return _gain(camera, optics.cos_fourth, optics.vignetting)


def polynomial_gain(radius: Float, coefficients: tuple[float, float, float]) -> Float:
    """1 + a r^2 + b r^4 + c r^6."""
    a, b, c = coefficients
    r2 = radius * radius
    return 1 + r2 * (a + r2 * (b + r2 * c))


def half_diagonals(camera: Camera, uv: Float) -> Float:
    """(...,) distances of the pixels `uv` (..., 2) from the principal point, in half diagonals of the frame."""
    from_axis = np.hypot(uv[..., 0] - camera.cx, uv[..., 1] - camera.cy)
    return np.asarray(from_axis / (np.hypot(camera.width, camera.height) / 2))


@lru_cache(maxsize=2)
def _gain(camera: Camera, cos_fourth: bool, coefficients: tuple[float, float, float]) -> NDArray[np.float32]:
    gain = np.ones(camera.frame.shape)
    if cos_fourth:  # of the angle to the axis of the true ray, before the lens distorted it
        xy = camera.centres(camera.frame)
        gain /= (1 + xy[..., 0] ** 2 + xy[..., 1] ** 2) ** 2
    if any(coefficients):
        v, u = np.indices(gain.shape) + 0.5
        gain *= polynomial_gain(half_diagonals(camera, np.stack([u, v], -1)), coefficients)
    return frozen(gain, np.float32)
