"""Veiling glare against its formula over the infinite plane."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.scene.sensor import Optics
from spin_usd.sensor.develop import scatter

ENERGY = 1e-4
PROFILE = 0.01  # relative: the coarse grids' kernels are Gaussians to this
SIZE = 601


def halo(core, falloff, at=(300, 300), share=1.0):
    """The light of a unit point that is scattered."""
    light = np.zeros((SIZE, SIZE), np.float32)
    light[at[1], at[0]] = 1
    return scatter(light, Optics(glare=share, glare_core=core, glare_falloff=falloff))


def profile(radius, core, falloff):
    """(1 + (r/c)^2)^(-p/2), whose integral over the plane is 2 pi c^2 / (p - 2)."""
    return (1 + (radius / core) ** 2) ** (-falloff / 2) * (falloff - 2) / (2 * np.pi * core**2)


def radii(at=(300, 300)):
    y, x = np.indices((SIZE, SIZE))
    return np.hypot(x - at[0], y - at[1])


@pytest.mark.parametrize(("core", "falloff"), [(4, 3), (2.5, 3.5), (20, 2.5), (9, 4)])
def test_the_halo_has_its_profile(core, falloff) -> None:
    for at in ((300, 300), (301, 303)):
        near = radii(at) < 200
        np.testing.assert_allclose(halo(core, falloff, at)[near], profile(radii(at), core, falloff)[near], rtol=PROFILE)


@given(st.floats(1.5, 6), st.floats(5, 8), st.integers(250, 350), st.integers(250, 350))
def test_a_halo_that_ends_in_the_frame_keeps_all_energy(core, falloff, x, y) -> None:
    outside = (1 + (250 / core) ** 2) ** (1 - falloff / 2)
    assert outside < ENERGY / 2
    assert halo(core, falloff, (x, y)).sum(dtype=np.float64) == pytest.approx(1, abs=ENERGY)


@pytest.mark.parametrize(("core", "falloff"), [(4, 3), (10, 2.4), (6, 5)])
def test_what_is_missing_is_what_falls_beside_the_frame(core, falloff) -> None:
    """Of a wide halo: the energy inside of a disc is 1 - (1 + (R/c)^2)^(1 - p/2)."""
    disc = radii() < 290
    inside = halo(core, falloff)[disc].sum(dtype=np.float64)
    rim = profile(290, core, falloff) * 2 * np.pi * 290  # a disc of pixels is round to a fraction of a pixel
    assert inside == pytest.approx(1 - (1 + (290 / core) ** 2) ** (1 - falloff / 2), abs=rim * 0.25 + 1e-3)


def test_a_share_is_scattered_and_the_rest_stays() -> None:
    all_of_it, some = halo(4, 3), halo(4, 3, share=0.07)
    expected = 0.07 * all_of_it
    expected[300, 300] += 0.93
    np.testing.assert_allclose(some, expected, rtol=1e-5, atol=1e-12)


def test_dim_light_is_scattered_like_bright_light() -> None:
    light = np.random.default_rng(0).random((120, 150)).astype(np.float32)
    optics = Optics(glare=0.3)
    np.testing.assert_allclose(scatter(light / 1024, optics) * 1024, scatter(light, optics), rtol=1e-5)
