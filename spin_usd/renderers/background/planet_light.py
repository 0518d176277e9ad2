"""All light that a planet sends, by rays that fill its disc: to render a small planet, and to know the amount."""

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.renderers.background.globe import Globe, Rays
from spin_usd.renderers.background.planet_points import Points
from spin_usd.renderers.background.planet_radiance import mean_radiance
from spin_usd.scene.light import DistantLight

STEPS = 96  # rings of rays; each is of twice as many


def planet_light(globe: Globe, suns: tuple[DistantLight, ...]) -> tuple[Rays, Float]:
    """Return rays (N,) that fill the cone in which the planet and its air are seen, and the light (N, 3) of each, R, G,
    B, W/m2."""
    rays, solid_angle = _filling_rays(globe)
    return rays, np.stack(mean_radiance(Points.of(globe, suns, rays)), -1).astype(np.float64) * solid_angle


def _filling_rays(globe: Globe) -> tuple[Rays, float]:
    """Return the rays and the solid angle of each, sr: in rings of equal solid angle, for 1 - cos grows evenly."""
    axis = globe.centre / globe.distance
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    up = np.cross(axis, across)
    versine = globe.angular_radius_sine**2 / (1 + np.sqrt(1 - globe.angular_radius_sine**2))
    v = (np.arange(STEPS) + 0.5) / STEPS * versine
    turn = (np.arange(2 * STEPS) + 0.5) / (2 * STEPS) * 2 * np.pi
    sine = np.sqrt(v * (2 - v))
    d = (
        (1 - v)[:, None, None] * axis
        + (sine[:, None] * np.cos(turn))[..., None] * across
        + (sine[:, None] * np.sin(turn))[..., None] * up
    ).reshape(-1, 3)
    # They span nothing: each meets the planet or does not.
    rays = Rays(x=d[:, 0], y=d[:, 1], z=d[:, 2], length=np.ones(len(d), np.float32), angle=np.zeros(len(d), np.float32))
    return rays, 2 * np.pi * versine / len(d)
