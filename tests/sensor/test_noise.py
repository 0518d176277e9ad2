"""Chance against SciPy's distributions, and the streams it is sampled from."""

import numpy as np
import pytest
from scipy import stats

from spin_usd.sensor.detector import FEW, PATTERN, READ, SHOT, pixel_gains, poisson, stream

DRAWS = 400_000
SIGMAS = 5.0  # standard errors that a sample's moment may be off


def sampled(mean, count=DRAWS, seed=3):
    return poisson(np.full(count, mean, np.float32), stream(seed, SHOT)).astype(np.float64)


@pytest.mark.parametrize("mean", [0.02, 0.7, 5, FEW - 0.01, FEW, 20, 100, 3000, 2e5])
def test_electrons_have_poissons_moments(mean) -> None:
    found = sampled(mean)
    expected = [float(moment) for moment in stats.poisson.stats(mean, moments="mvs")]
    fourth = mean * (1 + 3 * mean)  # the central moment
    errors = np.array([np.sqrt(mean), np.sqrt(fourth - mean**2), np.sqrt(6 + 30 / mean)]) / np.sqrt(DRAWS)
    moments = np.array([found.mean(), found.var(), stats.skew(found)])
    approximation = np.array([2e-5 * mean, 2e-5 * mean, 0.02 / np.sqrt(mean)]) if mean >= FEW else 0
    assert (np.abs(moments - expected) < SIGMAS * errors + approximation).all(), (moments, expected)


@pytest.mark.parametrize("mean", [0.3, 4, FEW, 15, 40])
def test_electrons_have_poissons_distribution(mean) -> None:
    """By a chi-square test of every count that is likely enough."""
    found = sampled(mean, 100_000).astype(int)
    counts = np.arange(found.max() + 1)
    likely = stats.poisson.pmf(counts, mean) * len(found) > 20
    observed = np.append(np.bincount(found)[likely], np.isin(found, counts[likely], invert=True).sum())
    expected = stats.poisson.pmf(counts[likely], mean) * len(found)
    expected = np.append(expected, len(found) - expected.sum())
    assert stats.chisquare(observed, expected).pvalue > 1e-4


def test_electrons_are_whole_and_none_is_less_than_none() -> None:
    mixed = np.linspace(0, 50, 20_000).astype(np.float32)
    found = poisson(mixed, stream(0, SHOT))
    assert (found == np.rint(found)).all()
    assert found.min() >= 0
    assert not poisson(np.zeros(1000, np.float32), stream(0, SHOT)).any()


def test_low_and_high_counts_meet() -> None:
    """In one image as alone."""
    mixed = np.tile(np.float32([1, 100]), DRAWS // 2)
    found = poisson(mixed, stream(1, SHOT))
    for start, mean in enumerate((1, 100)):
        half = found[start::2].astype(np.float64)
        assert abs(half.mean() - mean) < SIGMAS * np.sqrt(2 * mean / DRAWS)
        assert half.var() == pytest.approx(mean, rel=SIGMAS * np.sqrt((3 + 1 / mean) / (DRAWS / 2)))


def test_each_seed_and_purpose_has_its_own_stream() -> None:
    numbers = {
        (seed, purpose): stream(seed, purpose).standard_normal(20_000)
        for seed in (0, 1, 2**31 - 1)
        for purpose in (SHOT, READ, PATTERN)
    }
    table = np.array(list(numbers.values()))
    correlation = np.corrcoef(table) - np.eye(len(table))
    assert np.abs(correlation).max() < SIGMAS / np.sqrt(table.shape[1])
    np.testing.assert_array_equal(numbers[1, READ], stream(1, READ).standard_normal(20_000))


def test_pixel_gains_are_the_sensors_own() -> None:
    gains = pixel_gains((200, 300, 1), 0.02, 7)
    assert gains.mean() == pytest.approx(1, abs=SIGMAS * 0.02 / np.sqrt(gains.size))
    assert gains.std() == pytest.approx(0.02, rel=SIGMAS / np.sqrt(2 * gains.size))
    np.testing.assert_array_equal(gains, pixel_gains((200, 300, 1), 0.02, 7))
    assert (gains != pixel_gains((200, 300, 1), 0.02, 8)).mean() > 0.99
    np.testing.assert_allclose(pixel_gains((200, 300, 1), 0.01, 7) - 1, (gains - 1) / 2, atol=1e-6)
