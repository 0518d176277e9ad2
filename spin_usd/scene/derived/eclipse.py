"""Planets that stand before the Sun, or before another distant light, as seen from a place."""

from dataclasses import replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.geometry.directions import GOLDEN_ANGLE
from spin_usd.geometry.ellipsoid import rays_meet
from spin_usd.scene.environment import Planet
from spin_usd.scene.light import DistantLight, Light

RAYS = 4096  # over the disc: a limb across it is off by some thousandth of the disc
ROUNDING_RAD = 1e-7  # of an arc cosine near 0, with room


def eclipsed(lights: tuple[Light, ...], planets: tuple[Planet, ...], place_cam: Float) -> tuple[Light, ...]:
    """Return the lights as they reach `place_cam` (3,), camera frame, metres, past the planets: the distant ones, which
    lie behind all of them, with their `obscuration`. Without planets they are the same objects."""
    if not planets:
        return lights
    return tuple(
        replace(light, obscuration=obscuration(light, planets, place_cam)) if isinstance(light, DistantLight) else light
        for light in lights
    )


def obscuration(light: DistantLight, planets: tuple[Planet, ...], place_cam: Float) -> float:
    """Return the share of the light's irradiance at `place_cam` (3,), camera frame, metres, that the planets keep away.
    Their air keeps nothing away."""
    shadows = [(planet, *_shadow(light, planet, place_cam)) for planet in planets]
    if any(whole for _, _, whole in shadows):
        return 1.0
    crossing = [planet for planet, some, _ in shadows if some]
    if not crossing:
        return 0.0
    rays = disc(light)
    hidden = np.zeros(len(rays), bool)
    for planet in crossing:
        turn = planet.T_cam_planet.rotation  # row vectors times it are in the planet's axes
        start = (place_cam - planet.T_cam_planet.translation) @ turn
        hidden |= rays_meet(np.array(planet.radii), start, rays @ turn)
    return float(hidden.mean())


def _shadow(light: DistantLight, planet: Planet, place_cam: Float) -> tuple[bool, bool]:
    """Return whether the planet may hide some of the light's disc at the place, and whether it surely hides all of it.
    The balls around it and within it decide that, so that most pictures need no rays."""
    centre = planet.T_cam_planet.translation - place_cam
    far = float(np.linalg.norm(centre))
    if far <= max(planet.radii):
        return True, False
    apart = np.arccos(np.clip(-centre @ np.array(light.direction_cam) / far, -1, 1))
    outer, inner = np.arcsin(np.array([max(planet.radii), min(planet.radii)]) / far)
    margin = light.angle / 2 + ROUNDING_RAD
    return bool(apart < outer + margin), bool(apart < inner - margin)


def disc(light: DistantLight) -> Float:
    """Return (N, 3) unit directions to the light, camera frame, which all bring the same share of its irradiance; one
    where it has no size.

    A spiral that covers a disc evenly (H. Vogel, "A better way to construct the sunflower head", 1979): the disc is
    that onto which a plane that faces the light projects it, so that even large lights count by the cosine.
    """
    axis = -np.array(light.direction_cam)
    if light.angle == 0:
        return axis[None]
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    up = np.cross(axis, across)
    index = np.arange(RAYS)
    sine, turn = np.sin(light.angle / 2) * np.sqrt((index + 0.5) / RAYS), index * GOLDEN_ANGLE
    aside = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * up
    return np.asarray(np.sqrt(1 - sine * sine)[:, None] * axis + sine[:, None] * aside)
