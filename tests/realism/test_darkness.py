"""Black level and noise: planted ones are found, whatever the rest of the picture shows."""

import cv2
import numpy as np
import pytest

from spin_usd.realism.darkness import BLOCK, LEAST_BLOCKS, darkness, shot_noise
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.detector import detect
from spin_usd.sensor.tone import unrounded
from tests.cases.drawn_pictures import ellipse, written

SIZE = (192, 256)
SEEDS = range(20)
FOUND = 19
"""Of the seeds, at least: the tolerances are two standard deviations or more."""
BLOCKS = SIZE[0] * SIZE[1] / BLOCK**2 / 2  # at least: half of the picture is dark


def dark_half(level, noise, seed, size=SIZE):
    """A picture whose left half is dark, and whose right half is bright and full of detail."""
    rng = np.random.default_rng(1000 + seed)
    lit = np.zeros(size)
    lit[:, size[1] // 2 :] = rng.uniform(20, 200, (size[0], size[1] - size[1] // 2))
    return written(lit, level=level, noise=noise, seed=seed)


@pytest.mark.parametrize(("level", "noise"), [(30.0, 6.0), (12.4, 2.0), (29.5, 0.6)])
def test_the_planted_level_and_noise_are_found(level, noise) -> None:
    """The level is a mean of half of each dark block's pixels; the noise's error is that of N differences."""
    found = [darkness(dark_half(level, noise, seed)) for seed in SEEDS]
    pixels = BLOCKS * BLOCK**2 / 4  # half of the dark blocks pass for dark, at least, and half of their rows count
    assert sum(abs(each.level - level) < 2.5 * noise / pixels**0.5 + 0.02 for each in found) >= FOUND
    assert sum(abs(each.noise / noise - 1) < 4 / pixels**0.5 + 0.02 for each in found) >= FOUND


def test_of_an_undone_encoding_level_and_noise_are_those_of_the_light() -> None:
    """sRGB is a concave curve: the mean of what it writes is not what it writes of the mean. Undone pixel by pixel, the
    planted level comes back, but for the beat of the ADC's steps with the written ones, 0.05 of these."""
    steps, slope = 4095 / 255, 0.2  # of the ADC per step of 8 bits; of linear steps per written one, at 4
    sensor = Sensor(gain=7.9, read_noise=0.6 * steps * 7.9, black_level=4 * steps, encoding="srgb")
    signal = np.linspace(0, 1, 4096)
    found = []
    for seed in range(8):
        grey = detect(np.zeros((*SIZE, 1), np.float32), sensor, seed=seed)
        linear = 255 * np.interp(grey, unrounded(signal[:, None], sensor)[:, 0], signal)
        found.append(darkness(linear.astype(np.float32), rounding=slope**2 / 12))
    assert np.mean([each.level for each in found]) == pytest.approx(4, abs=0.05 * slope + 0.005)
    assert np.mean([each.noise for each in found]) == pytest.approx(0.6, rel=0.02)


def test_rounding_is_no_noise() -> None:
    """Steps of a slow ramp between whole numbers are rounded; noise of 0.05 steps is lost in that, not inflated."""
    ramp = np.linspace(20, 24, SIZE[1])[None] * np.ones((SIZE[0], 1))
    assert darkness(written(ramp, level=0, noise=0.0, seed=0)).noise < 0.05
    assert all(abs(darkness(dark_half(20.5, 0.5, seed)).noise - 0.5) < 0.06 for seed in SEEDS)


def test_a_picture_without_noise_has_none() -> None:
    found = darkness(np.full(SIZE, 7.0, np.float32))
    assert (found.level, found.noise, found.across, found.down, found.rows, found.columns) == (7, 0, 0, 0, 0, 0)


def test_what_is_lit_does_not_count() -> None:
    """The same dark half, beside black, white or detail: the same figures but for one block more or less."""
    one, other = dark_half(30, 6, 3), dark_half(30, 6, 3)
    other[:, SIZE[1] // 2 :] = 255
    a, b = darkness(one), darkness(other)
    assert a.level == pytest.approx(b.level, abs=0.2)
    assert a.noise == pytest.approx(b.noise, abs=0.1)


@pytest.mark.parametrize("axis", [0, 1])
def test_the_planted_correlation_of_neighbours_is_found(axis) -> None:
    """A moving average of weights 1 and w has the correlation w / (1 + w²) at a lag of one."""
    w = 0.3
    rng = np.random.default_rng(axis)
    white = rng.standard_normal(SIZE)
    grey = (40 + 6 * (white + w * np.roll(white, 1, axis)) / np.hypot(1, w)).astype(np.float32)
    found = darkness(grey)
    planted, scatter = w / (1 + w * w), 4 / (0.5 * SIZE[0] * SIZE[1]) ** 0.5
    bias = 1 / BLOCK**2  # a block's own mean is taken away
    along, across = (found.down, found.across) if axis == 0 else (found.across, found.down)
    assert abs(along - planted) < scatter + bias
    assert abs(across) < scatter + bias


def test_the_planted_pattern_of_rows_is_found() -> None:
    """Rows whose levels scatter by half of the noise; columns without a pattern."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        rows = 3.0 * rng.standard_normal((SIZE[0], 1))
        found = darkness((40 + rows + 6 * rng.standard_normal(SIZE)).astype(np.float32))
        # over the noise of all pixels, rows and all, and without the rows' mean in a block
        expected = 3 / np.hypot(6, 3) * (1 - 1 / BLOCK) ** 0.5
        assert found.rows == pytest.approx(expected, abs=0.12)
        assert found.columns < 0.12


def test_white_noise_has_no_pattern() -> None:
    found = darkness(written(np.zeros(SIZE), level=30, noise=6, seed=4))
    assert max(found.rows, found.columns) < 0.1


def test_few_dark_blocks_are_enough() -> None:
    grey = written(np.full(SIZE, 150.0), level=30, noise=4, seed=1)
    side = BLOCK * int(LEAST_BLOCKS**0.5)
    grey[:side, :side] = written(np.zeros((side, side)), level=30, noise=4, seed=2)
    assert darkness(grey).level == pytest.approx(30, abs=0.6)


@pytest.mark.parametrize("k", [0.1, 0.4])
@pytest.mark.parametrize("noise", [1.0, 5.0])
def test_the_planted_photon_transfer_is_found(k, noise) -> None:
    """EMVA 1288: the noise's variance is that in the dark plus k times the signal."""
    size = (480, 640)
    body = ellipse(size, 0.4)
    shade = cv2.GaussianBlur(np.random.default_rng(7).uniform(-1, 1, size), (0, 0), 25)
    signal = np.where(body, np.clip(90 + 80 * shade / np.abs(shade).max(), 0, None), 0)
    found = []
    for seed in range(4):
        grey = written(signal, level=30, noise=np.sqrt(noise**2 + k * signal), seed=seed)
        found.append(shot_noise(grey, darkness(grey)))
    assert np.mean(found) == pytest.approx(k, rel=0.1)


def test_without_lit_blocks_there_is_no_photon_transfer() -> None:
    grey = written(np.zeros(SIZE), level=30, noise=5, seed=0)
    assert np.isnan(shot_noise(grey, darkness(grey)))
