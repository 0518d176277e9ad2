"""Mechanical vignetting: 1 + a r^2 + b r^4 + c r^6, r half diagonals of the frame from the principal point."""

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera

STEPS = 4096  # of the radius, at which the least gain is sought

Coefficients = tuple[float, float, float]
"""a, b, c."""


def polynomial_gain(camera: Camera, coefficients: Coefficients, uv: Float) -> Float:
    """Return (...,) gain at the pixels `uv` (..., 2)."""
    return _gain(_squared_radius(camera, uv), coefficients)


def least_gain(camera: Camera, coefficients: Coefficients) -> float:
    """Return the least gain between the principal point and the frame's farthest corner."""
    farthest = float(_squared_radius(camera, camera.rim(1)).max())
    return float(_gain(np.linspace(0, farthest, STEPS), coefficients).min())


def _squared_radius(camera: Camera, uv: Float) -> Float:
    from_axis = uv - (camera.cx, camera.cy)
    return np.asarray((from_axis**2).sum(-1) / ((camera.width**2 + camera.height**2) / 4))


def _gain(r2: Float, coefficients: Coefficients) -> Float:
    a, b, c = coefficients
    return 1 + r2 * (a + r2 * (b + r2 * c))
