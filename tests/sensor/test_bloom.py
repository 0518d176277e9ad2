"""The artist's bloom: what is below the threshold stays, what is above gives as much as its glow takes."""

import numpy as np
import pytest

from spin_usd.scene.sensor import Optics
from spin_usd.sensor.develop import bloom

WIDE = Optics(bloom_intensity=1.0, bloom_scatter=0.7, bloom_threshold=1.0)


def disc(value, radius=5, size=301):
    y, x = np.indices((size, size)) - size // 2
    return np.where(np.hypot(x, y) < radius, value, 0).astype(np.float32)


def width(image):
    y, x = np.indices(image.shape) - image.shape[0] // 2
    return np.sqrt((image * (x**2 + y**2)).sum() / image.sum())


def test_dim_light_does_not_bloom() -> None:
    """The onset begins at half the threshold."""
    dim = disc(0.5)
    assert bloom(dim, WIDE, 1.0).tobytes() == dim.tobytes()


@pytest.mark.parametrize("scatter", [0.0, 0.3])
def test_energy_is_kept(scatter) -> None:
    """As far as the glow stays in the frame: the widest Gaussian has a quarter of its width."""
    light = disc(40.0)
    optics = Optics(bloom_intensity=0.8, bloom_scatter=scatter, bloom_threshold=1.0)
    assert bloom(light, optics, 1.0).sum(dtype=np.float64) == pytest.approx(light.sum(dtype=np.float64), rel=1e-3)


def test_the_threshold_is_in_the_unit_range() -> None:
    light = disc(3.0)
    np.testing.assert_allclose(bloom(light / 200, WIDE, 200.0), bloom(light, WIDE, 1.0) / 200, rtol=1e-5, atol=1e-9)


def test_far_above_the_threshold_everything_but_the_threshold_glows() -> None:
    light = disc(1000.0, radius=1)
    left = bloom(light, WIDE, 1.0)[150, 150]
    glow = bloom(light, WIDE, 1.0)[150, 153]
    assert left < 1000 * 0.05
    assert glow > 0


def test_intensity_is_two_to_the_power_less_one() -> None:
    light = disc(40.0)
    full = bloom(light, WIDE, 1.0) - light
    half = bloom(light, Optics(bloom_intensity=0.5, bloom_scatter=0.7), 1.0) - light
    np.testing.assert_allclose(half, (2**0.5 - 1) * full, atol=1e-5)


def test_scatter_widens() -> None:
    light = disc(40.0)
    widths = [width(bloom(light, Optics(bloom_intensity=1, bloom_scatter=s), 1.0)) for s in (0, 0.3, 0.6, 0.9)]
    assert widths == sorted(widths)
    assert widths[-1] > 3 * widths[0]


def test_the_colour_of_the_glow_is_that_of_the_light() -> None:
    light = disc(40.0)[..., None] * np.array([1, 0.5, 0.25], np.float32)
    glow = bloom(light, WIDE, 1.0)[150, 165]
    np.testing.assert_allclose(glow / glow[0], [1, 0.5, 0.25], rtol=1e-4)
