"""Eclipses against the overlap of two discs."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.geometry.ellipsoid import rays_meet
from spin_usd.geometry.transform import Transform
from spin_usd.scene.derived.eclipse import disc, eclipsed, obscuration
from spin_usd.scene.environment import Planet
from spin_usd.scene.light import DistantLight, DomeLight

SUN = DistantLight(path="/Sun", direction_cam=(0.6, 0.0, 0.8), irradiance=(1361.0, 1361.0, 1361.0), angle=0.0093)
TO_SUN, ASIDE = -np.array(SUN.direction_cam), np.array([0.8, 0.0, -0.6])
SHARE = 0.002  # of the disc: 4096 rays, and a limb across some 100 of them
PLACE = np.array([0.5, -0.3, 12.0])


def planet(direction, sine, distance=4e8, rotation=None, stretch=(1, 1, 1)):
    """A planet seen from PLACE in a direction, whose angular radius has this sine."""
    axes = np.eye(3) if rotation is None else rotation
    T_cam_planet = Transform(to="cam", of="planet", rotation=axes, translation=PLACE + distance * np.asarray(direction))
    a, b, c = distance * sine * np.array(stretch)
    return Planet(path="/P", T_cam_planet=T_cam_planet, radii=(a, b, c), albedo=(0.3,) * 3)


def tilted(angle):
    return np.cos(angle) * TO_SUN + np.sin(angle) * ASIDE


def overlap(r, s, d):
    """The area that discs of radii r and s share, their centres d apart, over that of the first: two segments."""
    if d >= r + s:
        return 0.0
    if d <= abs(r - s):
        return min(1.0, (s / r) ** 2)
    x = (d * d + r * r - s * s) / (2 * d)
    segments = r * r * np.arccos(x / r) - x * np.sqrt(r * r - x * x)
    segments += s * s * np.arccos((d - x) / s) - (d - x) * np.sqrt(s * s - (d - x) ** 2)
    return segments / (np.pi * r * r)


@pytest.mark.parametrize("size", [0.2, 0.9, 1.0, 1.3, 40.0])
@pytest.mark.parametrize("step", np.linspace(0, 1.05, 8))
def test_what_a_planet_hides_is_the_overlap_of_two_discs(size, step) -> None:
    """From the middle of the Sun to beyond its edge; the angles are small, so that the sky there is flat."""
    half = SUN.angle / 2
    apart = half * (abs(size - 1) + step * (1 + size - abs(size - 1))) if size != 0.2 else half * step * 1.2
    found = obscuration(SUN, (planet(tilted(apart), np.sin(size * half)),), PLACE)
    flat = 3e-3 * (size > 10)  # a planet of 40 Suns' size fills 21 degrees, and its limb is bent by as much
    assert found == pytest.approx(overlap(half, size * half, apart), abs=SHARE + flat)


def test_all_and_nothing_are_exact() -> None:
    half = SUN.angle / 2
    assert obscuration(SUN, (planet(TO_SUN, np.sin(half * 1.0001)),), PLACE) == 1
    assert obscuration(SUN, (planet(tilted(half * 3.001), np.sin(half * 2)),), PLACE) == 0
    assert obscuration(SUN, (planet(-TO_SUN, 0.9),), PLACE) == 0  # behind
    point = replace(SUN, angle=0.0)
    assert obscuration(point, (planet(tilted(0.0999), np.sin(0.1)),), PLACE) == 1
    assert obscuration(point, (planet(tilted(0.1001), np.sin(0.1)),), PLACE) == 0


def test_two_planets_hide_what_either_hides() -> None:
    half = SUN.angle / 2
    one, other = planet(tilted(half), np.sin(half)), planet(tilted(-half), np.sin(half), distance=2e8)
    share = obscuration(SUN, (one,), PLACE)
    assert obscuration(SUN, (one, one), PLACE) == share
    assert obscuration(SUN, (one, other), PLACE) == pytest.approx(2 * share, abs=SHARE)  # they touch


def test_an_ellipsoid_turns_with_its_axes() -> None:
    """One half as wide as the Sun across, and wide along the way: it hides an ellipse of half the area."""
    half = SUN.angle / 2
    rotation = np.stack([ASIDE, np.cross(TO_SUN, ASIDE), TO_SUN], -1)
    found = obscuration(SUN, (planet(TO_SUN, np.sin(half), rotation=rotation, stretch=(0.5, 1, 2)),), PLACE)
    assert found == pytest.approx(0.5, abs=SHARE)


def test_rays_of_large_lights_bring_irradiance_evenly() -> None:
    """Half of a hemisphere's irradiance comes from within 45 degrees: sin^2 of it."""
    wide = replace(SUN, angle=np.pi)
    cosine = disc(wide) @ TO_SUN
    assert (cosine > np.sqrt(0.5)).mean() == pytest.approx(0.5, abs=SHARE)
    np.testing.assert_allclose(np.linalg.norm(disc(wide), axis=1), 1, rtol=1e-12)
    assert obscuration(wide, (planet(TO_SUN, np.sin(np.pi / 6)),), PLACE) == pytest.approx(0.25, abs=SHARE)


def test_without_planets_and_for_other_lights_nothing_changes() -> None:
    axes = Transform(to="cam", of="dome", rotation=np.eye(3), translation=np.zeros(3))
    dome = DomeLight(path="/D", T_cam_dome=axes, radiance=(1.0,) * 3)
    lights = (SUN, dome)
    assert eclipsed(lights, (), PLACE) is lights
    dark, same = eclipsed(lights, (planet(TO_SUN, 0.5),), PLACE)
    assert same is dome
    assert (dark.at_target, dark.irradiance) == ((0, 0, 0), SUN.irradiance)
    assert SUN.at_target == SUN.irradiance


@pytest.mark.parametrize("angle", [0.0, 0.0093, 0.3])
def test_the_balls_that_spare_the_rays_change_nothing(angle) -> None:
    """Flattened planets all around a light, near its edges above all, against every ray."""
    rng = np.random.default_rng(3)
    light, found = replace(SUN, angle=angle), set()
    for _ in range(300):
        sine = rng.uniform(0.05, 0.9)
        body = planet(tilted(np.arcsin(sine) + rng.normal(0, 0.2)), sine, stretch=rng.uniform(0.6, 1, 3))
        start = PLACE - body.T_cam_planet.translation
        met = rays_meet(np.array(body.radii), start, disc(light)).mean()
        assert obscuration(light, (body,), PLACE) == met
        found.add(met)
    assert {0.0, 1.0} <= found
