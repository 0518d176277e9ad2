"""Constraints on sampled values: angles between camera, Sun, target and planet, in camera axes.

A planet is taken for the shell between two spheres, of its shortest and of its longest semi-axis.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.scene.environment import Sky

SUN = ("sun.direction", "sun.from_target")
PLANET = ("earth.direction", "earth.altitude")
GROUPS = (SUN, PLANET)
"""The parameters that are sampled together, in this order: the planet's place never changes the Sun's."""


@dataclass(frozen=True, kw_only=True)
class Constraint:
    """A condition that sampled values must meet."""

    description: str
    holds: Callable[[Sky, float], np.ndarray]
    bears_on: tuple[str, ...]
    """The parameters whose values decide it, any of them enough."""
    needs_planet: bool = False
    """True if the constraint is about a planet."""


def angle(a: Float, b: Float) -> Float:
    """Degrees between unit vectors (..., 3)."""
    found: Float = np.degrees(np.arccos(np.clip((a * b).sum(-1), -1, 1)))
    return found


def _unit(v: Float) -> Float:
    result: Float = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return result


def _boresight(sky: Sky) -> Float:
    """Return (N,) degrees of the Sun from the camera's axis."""
    assert sky.sun is not None
    return angle(sky.sun, np.array([0.0, 0.0, 1.0]))


def _target_lit(sky: Sky, most: float) -> np.ndarray:
    """Return whether the Sun, seen from the target, is within `most` degrees of the camera."""
    assert sky.sun is not None
    return np.asarray(angle(sky.sun, _unit(-sky.target)) <= most)


def _discs(sky: Sky) -> tuple[Float, Float, Float]:
    """Return the planet's direction (N, 3), and the angular radii of its two spheres (N,), degrees."""
    assert sky.planet is not None
    far = np.linalg.norm(sky.planet, axis=-1)
    least, most = np.degrees(np.arcsin(np.clip(np.outer(sky.radii, 1 / far), 0, 1)))
    return sky.planet / far[:, None], least, most


def _limb_from_frame(sky: Sky, degrees: float) -> np.ndarray:
    """Return whether the picture's rim is all outside the planet's disc, or all inside, by `degrees`; and the disc not
    inside it."""
    direction, least, most = _discs(sky)
    off = angle(sky.frame[None], direction[:, None])
    # A point is inside the convex rim if it is on the same side of each of the planes through neighbours of it.
    sides = np.cross(sky.frame, np.roll(sky.frame, -1, axis=0)) @ direction.T
    inside = (sides > 0).all(0) | (sides < 0).all(0)
    outside = (off.min(1) >= most + degrees) & ~inside
    return np.asarray(outside | (off.max(1) <= least - degrees))


def _limb_from_sun(sky: Sky, degrees: float) -> np.ndarray:
    """Return whether the Sun is outside the planet's disc by `degrees`: no eclipse."""
    assert sky.sun is not None
    direction, _, most = _discs(sky)
    return np.asarray(angle(sky.sun, direction) >= most + degrees)


def planet_behind(sky: Sky, degrees: float = 0.0) -> np.ndarray:
    """Return whether the planet neither covers a part of the target nor touches it: beside it in the view, or all
    behind it."""
    assert sky.planet is not None
    far, near = np.linalg.norm(sky.planet, axis=-1), np.linalg.norm(sky.target, axis=-1)
    size: Float = np.degrees(np.arcsin(np.clip(sky.target_radius / near, 0, 1)))
    direction, _, most = _discs(sky)
    beside = angle(direction, _unit(sky.target)) > size + most
    return np.asarray(beside | (far - sky.radii[1] > near + sky.target_radius))


CONSTRAINTS: Mapping[str, Constraint] = {
    "sun_from_boresight_deg": Constraint(
        description="The Sun is at least so many degrees from the camera's axis.",
        holds=lambda sky, least: np.asarray(_boresight(sky) >= least),
        bears_on=SUN,
    ),
    "sun_from_boresight_at_most_deg": Constraint(
        description="The Sun is at most so many degrees from the camera's axis; 90 is the half of the sky before it.",
        holds=lambda sky, most: np.asarray(_boresight(sky) <= most),
        bears_on=SUN,
    ),
    "target_lit_deg": Constraint(
        description="Seen from the target, the Sun is at most so many degrees from the camera: 0 is full light.",
        holds=_target_lit,
        bears_on=SUN,
    ),
    "limb_from_frame_deg": Constraint(
        description="The planet's limb is at least so many degrees outside the picture, whether the planet is in it.",
        holds=_limb_from_frame,
        bears_on=PLANET,
        needs_planet=True,
    ),
    "limb_from_sun_deg": Constraint(
        description="The Sun is at least so many degrees above the planet's limb, seen from the camera.",
        holds=_limb_from_sun,
        bears_on=SUN + PLANET,
        needs_planet=True,
    ),
}
"""By the name that a specification gives them."""
PLANET_BEHIND = "the planet behind the target"
"""A constraint that is always there: pictures have all of the target before planets."""
