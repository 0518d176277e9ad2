"""Light that the air scatters more than once, against photons that are followed one by one."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.renderers.background.globe import Globe, Rays
from spin_usd.renderers.background.planet_points import Points
from spin_usd.renderers.background.planet_surface import PlanetSurface
from spin_usd.renderers.background.sky import sky
from spin_usd.scene.environment import Planet
from spin_usd.scene.light import DistantLight
from tests.authorities.photons import reflectance_seen_from_above
from tests.cases import earths

DEPTHS = (0.068, 0.097, 0.221)  # of the bundled Earth
SUNS = (20.0, 70.0)  # degrees from the zenith
OFF = 0.014
"""Of reflectance: two streams, and one factor for all directions, are off by 0.0133 at most here. Light scattered once,
and lost otherwise, was off by 0.16 over clouds in blue."""
CURVED = 5e-3  # relative: of air masses on the ball, as `test_air_masses_are_chapmans` has it
WHITE = 0.02  # relative, for R and B of a cloud


def seen_from_above(albedo: float, sun_deg: float) -> np.ndarray:
    """Reflectances R, G, B of uniform ground straight below the camera."""
    cosine, sine = np.cos(np.radians(sun_deg)), np.sin(np.radians(sun_deg))
    scene = earths.seen_from((0, 0, earths.RADIUS + 7e5), albedo=(albedo,) * 3, clouds=None, haze=DEPTHS)
    light = replace(earths.SUN, direction_cam=(sine, 0.0, cosine), irradiance=(1.0,) * 3)
    frame = sky(replace(scene, lights=(light,)), seed=0)
    assert frame is not None
    middle = frame[earths.CAMERA.height // 2, earths.CAMERA.width // 2]
    return np.asarray(middle * np.pi / cosine)


@pytest.mark.parametrize("sun_deg", SUNS)
@pytest.mark.parametrize("albedo", [0.0, 0.4, 0.8])
def test_ground_is_as_bright_as_photons_make_it(albedo, sun_deg) -> None:
    rng = np.random.default_rng(0)
    wanted = [reflectance_seen_from_above(depth, albedo, np.cos(np.radians(sun_deg)), rng) for depth in DEPTHS]
    np.testing.assert_allclose(seen_from_above(albedo, sun_deg), wanted, atol=OFF)


def test_clouds_are_white() -> None:
    red, _, blue = seen_from_above(0.75, 45.0)
    assert blue == pytest.approx(red, rel=WHITE)


def test_a_shadow_is_bluer_than_ground_in_the_sun() -> None:
    points = Points.of(*low_sun())
    flat = np.ones((3, 4), np.float32)
    ground = PlanetSurface(
        ground=[flat] * 3, water=0 * flat, noise=0 * flat, ranges=0 * flat, rises=[None], clouds=None, veil=None
    )
    skylight = [np.float32(share.mean()) * flat for share in points.suns[0].skylight]
    (red, _, blue), (lit_red, _, lit_blue) = (ground.albedo(0, sunlit * flat, skylight) for sunlit in (0.25, 1.0))
    assert (lit_red == 1).all()
    assert (lit_blue == 1).all()
    assert (blue > 1.1 * red).all()


def test_a_glint_passes_the_air_twice_in_a_straight_line() -> None:
    globe, suns, rays = low_sun()
    sun, bare = (Points.of(each, suns, rays).suns[0] for each in (globe, replace(globe, planet=airless(globe.planet))))
    (toward,), (cosine,) = globe.meet(rays).toward, sun.cosine
    for channel, depth in enumerate(DEPTHS):
        through = np.exp(-depth * (1 / toward + 1 / cosine))
        assert sun.glint[channel][0] == pytest.approx(through * bare.glint[channel][0], rel=CURVED)


def low_sun() -> tuple[Globe, tuple[DistantLight, ...], Rays]:
    """The ground straight below, and a Sun that it mirrors 30 degrees from the zenith."""
    scene = earths.seen_from((0, 0, earths.RADIUS + 7e5), clouds=None, haze=DEPTHS)
    (planet,) = scene.environment.planets
    sun = replace(earths.SUN, direction_cam=(0.5, 0.0, np.sqrt(0.75)))
    return Globe(planet=planet, eye=np.zeros(3)), (sun,), Rays.through(earths.CAMERA, np.zeros((2, 1)))


def airless(planet: Planet) -> Planet:
    return replace(planet, haze=(0.0, 0.0, 0.0))
