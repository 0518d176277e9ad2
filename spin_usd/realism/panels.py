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
RING = 6
TILT = 0.45  # of the distance between neighbours, by which lights near one are turned from it
SIZES = (0.5, 2.0)
GOLDEN = np.pi * (1 + 5**0.5)
SUN, PANEL, WALL = "Sun", "Panel", "Wall"
WALL_WIDTH = 2.0  # of the distance: six walls are a cube around the target, whose faint light fills shadows
SIDES = np.concatenate([np.eye(3), -np.eye(3)])


def directions(count: int) -> Float:
    """Return (count, 3) unit directions that are evenly spread over the sphere. Source: the Fibonacci lattice."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(GOLDEN * i), radius * np.sin(GOLDEN * i), z], -1)


def names_around(count: int) -> tuple[str, ...]:
    """Return the names of `count` panels that face a target from all sides, of as many Suns, and of the six walls of a
    room."""
    counts = {PANEL: count, SUN: count, WALL: len(SIDES)} if count else {}
    return tuple(f"{kind}{number:03d}" for kind, of in counts.items() for number in range(of))


def is_wall(name: str) -> bool:
    """Return whether the light of that name is a wall."""
    return name.startswith(WALL)


def names_near(name: str) -> tuple[str, ...]:
    """Return the names of lights near one of `names_around`: six around it, and of a panel a smaller and a larger one;
    none near a wall."""
    return (
        ()
        if is_wall(name)
        else tuple(f"{name}_{number}" for number in range(RING + (2 if name.startswith(PANEL) else 0)))
    )


def light_around(name: str, centre: Float, radius: float, count: int) -> Light:
    """Return the light of that name; it makes an irradiance of about 1 W/m2 at the target's centre. `centre` (3,),
    camera axes, metres; `radius`: the target's, metres; `count`: as in names_around."""
    kind, number, near = _parsed(name)
    towards, size = SIDES[number] if kind == WALL else directions(count)[number], light_width(name)
    if near is not None and near < RING:
        axes, turn = facing(towards), 2 * np.pi * near / RING
        tilt = TILT * (4 * np.pi / count) ** 0.5
        towards = np.cos(tilt) * towards + np.sin(tilt) * (np.cos(turn) * axes[:, 0] + np.sin(turn) * axes[:, 1])
    if kind == SUN:
        x, y, z = (-towards).tolist()
        return DistantLight(path=name, direction_cam=(x, y, z), irradiance=(1.0, 1.0, 1.0))
    distance = max(DISTANCE * radius, LEAST_M)
    return RectLight(
        path=name,
        T_cam_light=Transform(to="cam", of="light", rotation=facing(towards), translation=centre + distance * towards),
        emission=(1 / size**2,) * 3,
        width=size * distance,
        height=size * distance,
    )


def light_width(name: str) -> float:
    """Return the width of the panel of that name over its distance."""
    kind, _, near = _parsed(name)
    if kind == WALL:
        return WALL_WIDTH
    return WIDTH if near is None or near < RING else WIDTH * SIZES[near - RING]


def _parsed(name: str) -> tuple[str, int, int | None]:
    """Return the kind of a light, its number, and the number of one near it."""
    kind = next(kind for kind in (SUN, PANEL, WALL) if name.startswith(kind))
    number, _, near = name.removeprefix(kind).partition("_")
    return kind, int(number), int(near) if near else None


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
