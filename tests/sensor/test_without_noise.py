"""The image without noise or rounding is what noise and rounding come on top of."""

from typing import Any

import numpy as np
import pytest

from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import AutoExposure, Optics, Sensor
from spin_usd.sensor.develop import develop, developed_without_noise
from tests.cases import scenes

CAMERA = Camera(width=60, height=40, fx=50, fy=50, cx=30, cy=20)
REGION = Region(x0=5, y0=5, x1=55, y1=35)
PICTURES = 200
NOISY = {"gain": 10.0, "read_noise": 12.0, "dark_current": 4e4, "prnu": 0.0, "black_level": 64.0, "full_well": 3e4}
FINE = {"bit_depth": 16, "encoding": "linear"}  # so fine that the written steps do not count


def picture(**sensor: Any) -> tuple[Scene, Radiance]:
    scene = scenes.scene(scenes.target(*scenes.box()), camera=CAMERA, sensor=Sensor(**sensor))
    object.__setattr__(scene, "optics", Optics(psf_sigma=0.7))
    light = np.random.default_rng(0).uniform(0, 1, (*REGION.shape, 4)).astype(np.float32)
    return scene, Radiance.of(REGION, light)


@pytest.mark.parametrize("channels", ["mono", "rgb"])
@pytest.mark.parametrize("encoding", ["srgb", "linear"])
def test_rounding_is_all_that_a_detector_without_noise_adds(channels, encoding) -> None:
    scene, radiance = picture(channels=channels, encoding=encoding, contrast=1.2, auto_exposure=AutoExposure())
    exact = developed_without_noise(scene, radiance, None)
    assert exact.dtype == np.float64
    assert np.array_equal(np.rint(exact), develop(scene, radiance, None, seed=1))


def test_noise_scatters_about_it() -> None:
    """The mean of many noisy pictures, against the scatter that they show themselves."""
    scene, radiance = picture(**NOISY, **FINE, exposure=0.5)
    noisy = np.stack([develop(scene, radiance, None, seed=seed) for seed in range(PICTURES)]).astype(float)
    off = noisy.mean(0) - developed_without_noise(scene, radiance, None)
    error = noisy.std(0, ddof=1) / np.sqrt(PICTURES)
    assert (error > 0).all()
    assert np.abs(off / error).max() < 6
    assert np.sqrt(np.mean((off / error) ** 2)) == pytest.approx(1, abs=0.1)


def test_a_full_well_and_the_adcs_range_end_it() -> None:
    held = developed_without_noise(*picture(**NOISY, **FINE, exposure=50.0), None)
    full = (NOISY["full_well"] / NOISY["gain"] + NOISY["black_level"]) / 4095 * 65535
    assert held.max() == pytest.approx(full)
    wide = {**NOISY, "full_well": 0.0}
    assert developed_without_noise(*picture(**wide, **FINE, exposure=50.0), None).max() == 65535
