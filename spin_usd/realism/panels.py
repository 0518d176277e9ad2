"""Lights all around a target, of which a fit finds those that shine."""

from dataclasses import replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.transform import Transform
from spin_usd.scene.light import DistantLight, DomeLight, Light, RectLight
from spin_usd.scene.texture import Color

DISTANCE = 4.0  # target radii, but LEAST_M at least
LEAST_M = 2.0
WIDTH = 0.4  # of the distance: 23 degrees
GOLDEN = np.pi * (1 + 5**0.5)
SUN, PANEL = "Sun", "Panel"


def directions(count: int) -> Float:
    """Return (count, 3) unit directions that are evenly spread over the sphere. Source: the Fibonacci lattice."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(GOLDEN * i), radius * np.sin(GOLDEN * i), z], -1)


def lights_around(centre: Float, radius: float, count: int) -> tuple[Light, ...]:
    """Return `count` square panels that face a target from all sides, and as many Suns: each makes an irradiance of
    about 1 W/m2 at its centre. `centre` (3,), camera axes, metres; `radius`: the target's, metres."""
    distance = max(DISTANCE * radius, LEAST_M)
    width = WIDTH * distance
    panels = [
        RectLight(
            path=f"{PANEL}{number:03d}",
            T_cam_light=Transform(to="cam", of="light", rotation=facing(to), translation=centre + distance * to),
            emission=(1 / WIDTH**2,) * 3,
            width=width,
            height=width,
        )
        for number, to in enumerate(directions(count))
    ]
    suns = [
        DistantLight(
            path=f"{SUN}{number:03d}",
            direction_cam=(-float(to[0]), -float(to[1]), -float(to[2])),
            irradiance=(1.0, 1.0, 1.0),
        )
        for number, to in enumerate(directions(count))
    ]
    return (*panels, *suns)


def scaled(light: Light, factor: float) -> Light:
    """Return a light that is `factor` times as strong."""

    def times(colour: Color) -> Color:
        r, g, b = (value * factor for value in colour)
        return r, g, b

    if isinstance(light, DistantLight):
        return replace(light, irradiance=times(light.irradiance))
    if isinstance(light, DomeLight):
        return replace(light, radiance=times(light.radiance))
    return replace(light, emission=times(light.emission))


def light_towards(light: Light, centre: Float) -> tuple[Float, float]:
    """Return the unit direction (3,) from a target's centre to a light, camera axes, and its distance, metres; 0 for
    one that is infinitely far."""
    if isinstance(light, DistantLight):
        return -np.array(light.direction_cam), 0.0
    if isinstance(light, DomeLight):
        return np.array((0.0, 0.0, -1.0)), 0.0
    offset = light.T_cam_light.translation - centre
    distance = float(np.linalg.norm(offset))
    return offset / max(distance, 1e-12), distance


def facing(towards: Float) -> Float:
    """Return (3, 3) the axes of a light that stands in the direction `towards` and shines back, along its -z."""
    side = np.cross((0.0, 1.0, 0.0) if abs(towards[1]) < 0.9 else (1.0, 0.0, 0.0), towards)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(towards, side), towards], -1)
