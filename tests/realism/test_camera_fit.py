"""The fitted camera: its pictures have the level, noise and shot noise that were fitted, and its sharpness."""

from dataclasses import replace

import numpy as np
import pytest

from spin_usd.realism.camera_fit import (
    SHARPEST,
    SIGMAS,
    before_jpeg,
    fit_camera,
    fitted_optics,
    fitted_sensor,
    sigma_of_spread,
)
from spin_usd.realism.darkness import darkness, shot_noise
from spin_usd.realism.picture_view import FULL
from spin_usd.scene.sensor import AutoExposure, Optics, Sensor
from spin_usd.sensor.detector import detect, in_the_dark

SIZE = (240, 320)
BASE = Sensor(
    iso=200.0,
    gain=3.0,
    read_noise=9.0,
    dark_current=50.0,
    full_well=9000.0,
    black_level=17.0,
    encoding="linear",
    auto_exposure=AutoExposure(),
)


def fit(noise=6.2, shot=0.2, sigma=1.1):
    return fit_camera([noise] * 5, [shot] * 5, [sigma] * 5)


def field(sensor, light, seed):
    """A flat field, in steps of 8 bits."""
    return detect(np.full((*SIZE, 1), light, np.float32), sensor, seed=seed).astype(np.float32)


@pytest.mark.parametrize(("level", "noise", "shot"), [(29.5, 6.2, 0.1), (40.0, 2.0, 0.5)])
def test_flat_fields_have_the_fits_photon_transfer(level, noise, shot) -> None:
    """EMVA 1288: mean and temporal variance of pairs of flat fields, beside rounding to 8 bits. 76,800 pixels know a
    variance to 0.5 %."""
    sensor = fitted_sensor(BASE, fit(noise, shot), level)
    for light in (0.0, 0.1, 0.3, 0.5):
        one, other = field(sensor, light, 1), field(sensor, light, 2)
        signal = FULL * light
        assert (one.mean() + other.mean()) / 2 == pytest.approx(level + signal, abs=0.15)
        assert (one - other).var() / 2 - 1 / 12 == pytest.approx(noise**2 + shot * signal, rel=0.03)
    dark, spread = in_the_dark(sensor)
    assert (FULL * dark, FULL * spread) == pytest.approx((level, noise))


def test_its_pictures_are_measured_as_they_were_fitted() -> None:
    """There and back: what darkness and photon transfer find in pictures of the fitted camera is the fit. The photon
    transfer of one picture is known to 7 %, by the noise of its 400 dark blocks: so the mean of eight counts."""
    sensor, slopes = fitted_sensor(BASE, fit(5.0, 0.3), 30.0), []
    steps = np.repeat([0.0] * 6 + np.linspace(0, 0.6, 10)[1:].tolist(), SIZE[1] // 10)  # mostly dark, as real ones are
    light = np.tile(steps, (SIZE[0], 1))[..., None].astype(np.float32)
    for seed in range(8):
        grey = detect(light, sensor, seed=seed).astype(np.float32)
        found = darkness(grey)
        assert found.level == pytest.approx(30, abs=0.3)
        assert found.noise == pytest.approx(5, rel=0.05)
        slopes.append(shot_noise(grey, found))
    assert np.mean(slopes) == pytest.approx(0.3, rel=0.05)


def test_the_fit_is_of_no_iso_and_keeps_what_it_does_not_know() -> None:
    """The photon transfer is that of the fit at any ISO; exposure, encoding and channels stay."""
    for iso in (100.0, 800.0):
        sensor = fitted_sensor(replace(BASE, iso=iso), fit(), 30.0)
        assert FULL * in_the_dark(sensor)[1] == pytest.approx(6.2)
        assert (sensor.exposure, sensor.encoding, sensor.iso) == (BASE.exposure, BASE.encoding, iso)
    assert sensor.auto_exposure is None


@pytest.mark.parametrize(
    ("quality", "noise", "shot"), [(75, 8.0, 0.3), (85, 6.0, 0.2), (75, 5.0, 0.3), (90, 1.0, 0.3), (0, 6.0, 0.1)]
)
def test_noise_before_a_jpeg_is_found(quality, noise, shot) -> None:
    """There and back: a camera that compresses leaves less noise, and neighbours correlated, but not across blocks."""
    sensor = replace(fitted_sensor(BASE, fit(noise, shot), 30.0), jpeg_quality=quality)
    steps = np.repeat([0.0] * 6 + np.linspace(0, 0.6, 10)[1:].tolist(), SIZE[1] // 10)
    light = np.tile(steps, (SIZE[0], 1))[..., None].astype(np.float32)
    pictures = [detect(light, sensor, seed=seed).astype(np.float32) for seed in range(6)]
    dark = [darkness(picture) for picture in pictures]
    real = {
        "black_level": np.median([each.level for each in dark]),
        "noise": np.median([each.noise for each in dark]),
        "noise_across": np.median([each.across for each in dark]),
        "noise_down": np.median([each.down for each in dark]),
        "shot_noise": np.median([shot_noise(*each) for each in zip(pictures, dark, strict=True)]),
    }
    found = before_jpeg(fit(real["noise"], real["shot_noise"]), real)
    assert found.noise == pytest.approx(noise, rel=0.08)
    assert found.shot_noise == pytest.approx(shot, rel=0.25)
    if not quality:
        assert found.jpeg_quality is None
        return
    low, high = found.intervals["jpeg_quality"]
    assert low <= quality <= high
    assert real["noise"] < 0.95 * noise
    assert 2 * np.median([each.borders for each in dark]) < real["noise_across"]
    assert fitted_sensor(BASE, found, 30.0).jpeg_quality == found.jpeg_quality


def test_blurred_noise_is_correlated_across_blocks_too() -> None:
    """Such as of a camera that interpolates its colours: that is no JPEG's loss."""
    chance = np.random.default_rng(0).standard_normal((SIZE[0] + 1, SIZE[1] + 1))
    blurred = 30 + 4 * (chance[1:, 1:] + chance[:-1, 1:] + chance[1:, :-1] + chance[:-1, :-1])
    found = darkness(np.rint(blurred).astype(np.float32))
    assert found.borders == pytest.approx(found.across, abs=0.1)
    assert found.across > 0.4


def test_without_shot_noise_the_gain_is_finite() -> None:
    sensor = fitted_sensor(BASE, fit(shot=0.0), 0.0)
    assert np.isfinite([sensor.gain, sensor.read_noise]).all()
    assert field(sensor, 0.5, 1).std() < 7


def test_values_are_medians_and_unknown_ones_none() -> None:
    found = fit_camera([1, 2, np.nan, 3], [np.nan] * 4, [0.5, 0.7, 0.9, 1.1])
    assert (found.noise, found.shot_noise) == (2, None)
    assert found.psf_sigma == pytest.approx(0.8)
    low, high = found.intervals["noise"]
    assert 1 <= low <= 2 <= high <= 3
    assert set(found.intervals) == {"noise", "psf_sigma"}


def test_a_value_of_two_pictures_is_not_a_fit() -> None:
    """Such as of pictures without clear edges: the point spread function then stays."""
    found = fit_camera([1, 2, 3], [0.1, np.nan, 0.2], [0.9, np.nan, np.nan])
    assert (found.shot_noise, found.psf_sigma, list(found.intervals)) == (None, None, ["noise"])
    assert fitted_optics(Optics(psf_sigma=0.4), found).psf_sigma == 0.4


def test_noise_that_is_not_known_stays_the_sensors() -> None:
    """In steps of 8 bits, whatever the bits of its ADC."""
    before = replace(BASE, adc_bits=10, black_level=0.0, full_well=0.0)
    after = fitted_sensor(before, fit_camera([6.0, 6.1], [0.1], [1.0]), 20.0)
    dark, spread = in_the_dark(after)
    assert (FULL * dark, spread) == pytest.approx((20, in_the_dark(before)[1]))
    one, other = (field(after, 0.4, seed) for seed in (1, 2))
    plain, twin = (field(replace(before, auto_exposure=None), 0.4, seed) for seed in (3, 4))
    assert (one - other).var() == pytest.approx((plain - twin).var(), rel=0.05)
    ideal = fitted_sensor(Sensor(encoding="linear"), fit_camera([], [], []), 20.0)
    assert FULL * in_the_dark(ideal)[1] == 0


@pytest.mark.parametrize("noise", [0.0, np.nan])
def test_a_jpeg_without_noise_has_no_quality_to_find(noise) -> None:
    real = {"black_level": 1.0, "noise": noise, "noise_across": 0.9, "noise_down": 0.9, "shot_noise": np.nan}
    assert before_jpeg(fit(), real) == fit()


def test_the_spread_function_of_a_spread_is_found_back() -> None:
    """With our edges of known widths: at each candidate exactly, between them by interpolation."""
    spreads = np.sqrt(np.array(SIGMAS) ** 2 + 0.5**2)
    assert [sigma_of_spread(spread, spreads) for spread in spreads] == pytest.approx(SIGMAS)
    between = sigma_of_spread(float(np.hypot(1.0, 0.5)), spreads)
    assert between == pytest.approx(1.0, abs=0.02)
    assert sigma_of_spread(0.1, spreads) == 0
    assert sigma_of_spread(9.0, spreads) == SIGMAS[-1]


def test_a_spread_that_is_not_known_has_no_sigma() -> None:
    spreads = np.full(len(SIGMAS), np.nan)
    assert np.isnan(sigma_of_spread(1.0, spreads))
    assert np.isnan(sigma_of_spread(np.nan, np.array(SIGMAS)))
    spreads[[2, 5]] = 0.6, 1.2
    assert sigma_of_spread(0.6, spreads) == SIGMAS[2]
    assert np.isnan(sigma_of_spread(1.3, spreads))  # ours are not known to be so wide, nor so narrow
    assert np.isnan(sigma_of_spread(0.5, spreads))
    falling = np.array(SIGMAS) + 0.3
    falling[4] = 0.2  # a chance dip does not lead back
    assert sigma_of_spread(SIGMAS[7] + 0.3, falling) == pytest.approx(SIGMAS[7])


def test_optics_take_the_spread_function_if_it_is_seen() -> None:
    glare = Optics(psf_sigma=0.4, glare=0.02)
    assert fitted_optics(glare, fit(sigma=1.3)) == replace(glare, psf_sigma=1.3)
    assert fitted_optics(glare, fit(sigma=SHARPEST / 2)) == replace(glare, psf_sigma=0.0)
