"""Measures of the target's light, against numpy, scipy and planted values."""

import numpy as np
import pytest
from scipy.stats import wasserstein_distance

from spin_usd.realism import signals
from spin_usd.realism.picture_view import EDGE_PX, SMOOTHED_NOISE, smoothed
from tests.cases.drawn_pictures import ellipse, view, written

SIZE = (160, 208)
TARGET = ellipse(SIZE)


def lit(seed, brightest=120):
    """A picture with a smooth random signal on its target."""
    rough = np.abs(smoothed(np.random.default_rng(seed).standard_normal(SIZE).astype(np.float32), 6))
    return view(written(np.where(TARGET, brightest * rough / rough.max(), 0), level=30, noise=3, seed=seed), TARGET)


def test_correlation_is_pearsons() -> None:
    one, other = lit(1), lit(2)
    expected = np.corrcoef(one.smooth[TARGET], other.smooth[TARGET])[0, 1]
    assert signals.correlation(one.smooth, other.smooth, TARGET) == pytest.approx(expected, abs=1e-6)
    assert signals.correlation(one.smooth, 3 * one.smooth + 7, TARGET) == pytest.approx(1, abs=1e-6)
    assert signals.correlation(one.smooth, -one.smooth, TARGET) == pytest.approx(-1, abs=1e-6)


def test_correlation_with_a_constant_is_none_and_of_few_pixels_unknown() -> None:
    one, few = lit(1), np.zeros(SIZE, bool)
    few[0, : signals.LEAST_PIXELS - 1] = True
    assert signals.correlation(one.smooth, np.ones(SIZE, np.float32), TARGET) == 0
    assert np.isnan(signals.correlation(one.smooth, one.smooth, few))
    assert np.isnan(signals.wasserstein(one, one, few))


def test_the_distance_is_scipys() -> None:
    one, other = lit(1), lit(2, brightest=80)
    expected = wasserstein_distance(one.smooth[TARGET].astype(float), other.smooth[TARGET].astype(float))
    assert signals.wasserstein(one, other, TARGET) == pytest.approx(expected, rel=1e-9)
    assert signals.wasserstein(one, one, TARGET) == 0


def test_a_lit_background_changes_nothing_on_the_target() -> None:
    """Nor does a lit target its surroundings, whose black level is the rest's."""
    one = lit(1)
    bright = np.where(TARGET, one.grey, 200).astype(np.float32)
    bright[:40] = one.grey[:40]  # the room
    other = view(bright, TARGET)
    assert other.smooth[TARGET] == pytest.approx(one.smooth[TARGET], abs=0.5)
    assert signals.correlation(one.smooth, other.smooth, TARGET) > 0.9999
    assert signals.lit_background(one) < 0.01


def test_dark_and_saturated_shares_are_those_planted() -> None:
    """Quarters of the frame: dark, dim, bright and full; borders between them are smooth."""
    signal = np.zeros(SIZE)
    rows, columns = SIZE[0] // 2, SIZE[1] // 2
    signal[:rows, columns:], signal[rows:, :columns], signal[rows:, columns:] = 40, 120, 400
    of = view(written(signal, level=30, noise=3, seed=0), np.ones(SIZE, bool))
    border = 3 * 2.0 * (rows + columns) / (SIZE[0] * SIZE[1])  # pixels within three sigmas of two borders
    assert signals.dark_share(of) == pytest.approx(0.25, abs=border)
    assert signals.saturated_share(of) == 0.25
    assert signals.dark_share(of, 60) == pytest.approx(0.5, abs=border)


def test_dark_is_what_noise_alone_reaches() -> None:
    """Of a smooth field of noise alone, three standard deviations hold all but 0.1 %."""
    of = view(written(np.zeros((480, 640)), level=30, noise=6, seed=5), ellipse((480, 640), 0.45))
    assert signals.dark_share(of) > 0.995
    assert signals.lit_background(of) < 0.005
    assert of.smooth.std() == pytest.approx(SMOOTHED_NOISE * 6, rel=0.1)


def test_quantiles_and_background() -> None:
    signal = np.where(TARGET, 100.0, 0)
    signal[:, :10] = 80
    of = view(written(signal, level=30, noise=1, seed=0), TARGET)
    assert signals.signal_median(of) == pytest.approx(100, abs=0.5)
    assert signals.signal_p90(of) == pytest.approx(100, abs=1)
    around = 10 * SIZE[0] / (~TARGET).sum()
    assert around < signals.lit_background(of) < around + 0.15  # and the target's own, to three sigmas around it


def test_a_picture_without_a_target_has_no_values() -> None:
    of = view(written(np.zeros(SIZE), level=30, noise=3, seed=0), np.zeros(SIZE, bool))
    for measure in (
        signals.signal_median,
        signals.signal_p90,
        signals.dark_share,
        signals.saturated_share,
        signals.spectrum_slope,
    ):
        assert np.isnan(measure(of))


@pytest.mark.parametrize("slope", [1.0, 2.0, 3.0])
def test_the_slope_of_a_power_law_comes_back(slope) -> None:
    """Noise whose power falls as the frequency to that power; a mean of 8 fields."""
    found = []
    for seed in range(8):
        side = 192
        f = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None])
        f[0, 0] = np.inf
        field = np.fft.irfft2(
            np.fft.rfft2(np.random.default_rng(seed).standard_normal((side, side))) * f ** (-slope / 2)
        )
        signal = np.zeros((side + 64, side + 64))
        signal[32:-32, 32:-32] = 110 + 18 * field / field.std()
        found.append(signals.spectrum_slope(view(30 + signal, signal > 0)))
    assert np.mean(found) == pytest.approx(-slope, abs=0.2)


def test_parts_lose_their_edges() -> None:
    of = view(np.zeros(SIZE), TARGET)
    inner = of.part(1)
    rows = np.flatnonzero(TARGET[:, SIZE[1] // 2])
    assert np.flatnonzero(inner[:, SIZE[1] // 2]).tolist() == rows[EDGE_PX:-EDGE_PX].tolist()
    assert not of.part(2).any()
    assert view(np.zeros(SIZE), np.ones(SIZE)).part(1).all()  # nothing is known beyond the frame
