"""Bootstrap intervals hold the truth as often as they say."""

import numpy as np
import pytest
from scipy.stats import binom

from spin_usd.realism.intervals import interval, median_interval

SAMPLES = 200


@pytest.mark.parametrize("draw", ["standard_normal", "standard_exponential"])
def test_the_interval_of_a_median_holds_the_true_one(draw) -> None:
    """95 % of 200 samples of 25, within three standard deviations; percentiles of so few lose 2 % more."""
    truth = {"standard_normal": 0.0, "standard_exponential": np.log(2)}[draw]
    rng = np.random.default_rng(1)
    spans = [median_interval(getattr(rng, draw)(25))[1] for _ in range(SAMPLES)]
    holding = sum(low <= truth <= high for low, high in spans)
    assert binom.ppf(0.001, SAMPLES, 0.93) <= holding <= binom.ppf(0.999, SAMPLES, 0.97)


def test_the_interval_of_a_mean_is_the_textbooks() -> None:
    values = np.random.default_rng(2).standard_normal(100)
    found, (low, high) = interval(values, lambda drawn: drawn.mean(axis=1))
    half = 1.96 * values.std() / 10
    assert found == pytest.approx(values.mean())
    assert (low, high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.15 * half)


def test_what_is_not_finite_is_left_out() -> None:
    assert median_interval([1, np.nan, 3, 2, np.inf]) == median_interval([1, 3, 2])
    found, span = median_interval([np.nan])
    assert np.isnan([found, *span]).all()


def test_two_values_have_no_interval() -> None:
    """Drawn again, they would be sure of themselves in half of all cases."""
    for values in ([5.0], [4.0, 6.0]):
        found, span = median_interval(values)
        assert found == 5
        assert np.isnan(span).all()
    assert np.isfinite(median_interval([4.0, 5.0, 6.0])[1]).all()


def test_the_same_values_have_the_same_interval() -> None:
    values = np.random.default_rng(3).standard_normal(12)
    assert median_interval(values) == median_interval(values)
