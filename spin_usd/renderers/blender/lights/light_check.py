"""Limits of lights that Blender can render; Blender's own lights clamp silently."""

import numpy as np

from spin_usd.errors import UnsupportedError
from spin_usd.scene.light import AreaLight, DistantLight

MAX_ANGLE = 3.0  # radians; Blender clamps a little above


def refuse_clamped(light: DistantLight | AreaLight) -> None:
    """Raise UnsupportedError, with the light's path, for a light that cannot be rendered as it is meant."""
    if isinstance(light, DistantLight):
        _check_color(light.irradiance, "irradiance", light.path)
        _check_distant(light)
    else:
        _check_color(light.emission, "emission", light.path)
        _check_area(light)


def _check_color(color: tuple[float, float, float], name: str, path: str) -> None:
    if not np.isfinite(color).all() or min(color) < 0:
        do = "make it finite and not negative"
        raise UnsupportedError(f"its {name} is {color}", where=path, do=do)


def _check_distant(light: DistantLight) -> None:
    if not 0 <= light.angle <= MAX_ANGLE:
        do = f"keep it between 0 and {np.degrees(MAX_ANGLE):.4g} degrees, or use a DomeLight"
        raise UnsupportedError(f"its angle is {np.degrees(light.angle):.4g} degrees", where=light.path, do=do)
    if abs(float(np.linalg.norm(light.direction_cam)) - 1) > 1e-6:
        found = f"its direction {light.direction_cam} is not of unit length"
        raise UnsupportedError(found, where=light.path, do="divide it by its length")


def _check_area(light: AreaLight) -> None:
    if not all(np.isfinite(length) and length > 0 for length in light.size):
        raise UnsupportedError(f"its size is {light.size}", where=light.path, do="make it finite and above 0")
