"""Light that the air scatters more than once, against photons that are followed one by one."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.renderers.background.sky import sky
from tests.authorities.photons import reflectance_seen_from_above
from tests.cases import earths

DEPTHS = (0.068, 0.097, 0.221)  # of the bundled Earth
SUNS = (20.0, 70.0)  # degrees from the zenith
OFF = 0.014
"""Of reflectance: two streams, and one factor for all directions, are off by 0.0133 at most here. Light scattered once,
and lost otherwise, was off by 0.16 over clouds in blue."""
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
