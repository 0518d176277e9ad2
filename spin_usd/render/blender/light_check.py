"""What a light must be for Blender to draw it; its Blender counterpart clamps silently."""

import numpy as np

from spin_usd.errors import UnsupportedError
from spin_usd.scene.light import AreaLight, DistantLight

MAX_ANGLE = 3.0  # radians; Blender clamps a little above
SIZES = {"point": 0, "sphere": 1, "disk": 2, "rect": 2, "cylinder": 2}
"""How many numbers the size of each shape has."""


def check_light(light: DistantLight | AreaLight) -> None:
    """Raise UnsupportedError, with the light's path, for what cannot be drawn as it is meant."""
    if isinstance(light, DistantLight):
        _check_color(light.irradiance, "irradiance", light.path)
        _check_distant(light)
    else:
        _check_color(light.emission, "emission", light.path)
        _check_area(light)


def _check_color(color: tuple[float, float, float], name: str, path: str) -> None:
    if not np.isfinite(color).all() or min(color) < 0:
        raise UnsupportedError(f"{name} {color} is not finite and positive", where=path)


def _check_distant(light: DistantLight) -> None:
    if not 0 <= light.angle <= MAX_ANGLE:
        raise UnsupportedError(f"angle is {light.angle} rad, expected 0 to {MAX_ANGLE}", where=light.path)
    if abs(float(np.linalg.norm(light.direction_cam)) - 1) > 1e-6:
        raise UnsupportedError(f"direction {light.direction_cam} is not of unit length", where=light.path)


def _check_area(light: AreaLight) -> None:
    if len(light.size) != SIZES.get(light.shape, -1):
        raise UnsupportedError(f"is a {light.shape} with {len(light.size)} sizes", where=light.path)
    if not all(np.isfinite(size) and size > 0 for size in light.size):
        raise UnsupportedError(f"size {light.size} is not finite and positive", where=light.path)
    if light.image is not None and light.shape != "rect":
        raise UnsupportedError(f"is a {light.shape} with an image", where=light.path)
