"""Constraints held against the definitions of their angles."""

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.sampling.constraints import CONSTRAINTS, planet_behind
from spin_usd.scene.environment import Sky

RADIUS = 6.378e6
CAMERA = Camera(width=400, height=300, fx=500, fy=500, cx=200, cy=150)


def at(degrees, about=0.0):
    """The direction so many degrees from the camera's axis."""
    a, b = np.radians([degrees, about])
    return np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])


def sky(*, sun=0.0, target=(0, 0, 10), planet=None, far=7e6):
    rays = CAMERA.rays(CAMERA.rim(16))
    return Sky(
        sun=at(sun)[None],
        target=np.array([target], float),
        target_radius=1.0,
        planet=None if planet is None else (far * at(planet))[None],
        radii=(RADIUS, RADIUS),
        frame=rays / np.linalg.norm(rays, axis=1, keepdims=True),
    )


def holds(name, degrees, **where):
    return bool(CONSTRAINTS[name].holds(sky(**where), degrees).all())


@pytest.mark.parametrize("degrees", [5.0, 60.0, 120.0, 175.0])
def test_the_sun_is_kept_from_the_boresight_and_to_it(degrees) -> None:
    assert holds("sun_from_boresight_deg", degrees - 0.1, sun=degrees)
    assert not holds("sun_from_boresight_deg", degrees + 0.1, sun=degrees)
    assert holds("sun_from_boresight_at_most_deg", degrees + 0.1, sun=degrees)
    assert not holds("sun_from_boresight_at_most_deg", degrees - 0.1, sun=degrees)


def test_a_target_on_the_axis_is_lit_from_behind_the_camera() -> None:
    for sun in (180.0, 120.0, 100.0):
        assert holds("target_lit_deg", 180 - sun + 0.1, sun=sun)
        assert not holds("target_lit_deg", 180 - sun - 0.1, sun=sun)


def test_a_target_aside_is_lit_as_it_is_seen() -> None:
    aside = 10 * at(20)
    assert holds("target_lit_deg", 0.1, sun=-160, target=aside)


def test_the_limb_is_kept_out_of_the_picture_on_both_sides() -> None:
    corner = np.degrees(np.arctan(np.hypot(200, 150) / 500))
    disc = np.degrees(np.arcsin(RADIUS / 7e6))
    edge = np.degrees(np.arctan(200 / 500))  # along x, where `at` puts the planet
    assert holds("limb_from_frame_deg", 5, planet=disc + edge + 5.1)
    assert not holds("limb_from_frame_deg", 5, planet=disc + edge + 4)
    assert holds("limb_from_frame_deg", 5, planet=disc - corner - 5.1)
    assert not holds("limb_from_frame_deg", 5, planet=disc - edge - 4)
    small = {"planet": 0.0, "far": 1e9}  # the whole disc is in the picture
    assert not holds("limb_from_frame_deg", 0.1, **small)
    assert holds("limb_from_frame_deg", 0.1, planet=90.0, far=1e9)


def test_the_sun_is_kept_from_the_limb() -> None:
    disc = np.degrees(np.arcsin(RADIUS / 7e6))
    assert holds("limb_from_sun_deg", 3, sun=0, planet=disc + 3.1)
    assert not holds("limb_from_sun_deg", 3, sun=0, planet=disc + 2.9)


def test_planets_stay_behind_the_target() -> None:
    assert planet_behind(sky(planet=0.0, far=7e6)).all()
    assert not planet_behind(sky(planet=0.0, far=RADIUS + 5)).any()
    assert planet_behind(sky(planet=170.0, far=7e6)).all()
