"""Variance and bias that are known are found, within what chance allows."""

import numpy as np
import pytest

from spin_usd.accuracy.error import FLOOR, Reference, linear_error
from spin_usd.errors import InputError

PIXELS = 20000
SEEDS, PARTS = 3, 4
CHANCE = 5  # standard errors: one run in a million fails by luck, and the generator is seeded


def rng(seed=0):
    return np.random.default_rng(seed)


def truth():
    return rng(1).uniform(0.5, 2.0, (PIXELS, 3))


def noisy(value, sigma, count, seed):
    """`count` pictures of `value` with normal noise of the relative standard deviation `sigma`, relative to each
    pixel's own power: so that the relative variance is sigma^2 but for the floor's little."""
    power = np.sqrt((value * value).mean(-1, keepdims=True))
    return value + sigma * power * rng(seed).standard_normal((count, *value.shape))


def lit(value):
    """Mean of each pixel's square over that and the floor's: noise in proportion to pixels counts by so much."""
    power = (value * value).mean(-1)
    return (power / (power + (FLOOR * value.mean()) ** 2)).mean()


def known_reference(value):
    return Reference(radiance=value, variance=np.zeros_like(value), parts=2)


def standard_error(sigma, count):
    """Of the mean of that many squares of normal numbers of variance sigma^2."""
    return sigma**2 * np.sqrt(2 / count)


def test_variance_and_bias_are_reported_apart() -> None:
    value, sigma, bias = truth(), 0.2, 0.1
    found = linear_error(noisy((1 + bias) * value, sigma / (1 + bias), SEEDS, 2), known_reference(value))
    chance = CHANCE * standard_error(sigma, 3 * PIXELS)
    assert found.variance == pytest.approx(sigma**2 * lit(value), abs=chance)
    assert found.bias_squared == pytest.approx(
        bias**2 * lit(value), abs=chance + 2 * bias * sigma / np.sqrt(PIXELS) * CHANCE
    )
    assert found.brightness == pytest.approx(bias, abs=CHANCE * sigma / np.sqrt(3 * PIXELS))
    assert found.squared == found.variance + found.bias_squared


def test_no_bias_is_found_where_there_is_none_whatever_the_references_noise() -> None:
    """The reference is as noisy as what is compared with it."""
    value, sigma = truth(), 0.3
    reference = Reference.of(noisy(value, sigma, PARTS, 3))
    found = linear_error(noisy(value, sigma, SEEDS, 4), reference)
    scatter = standard_error(sigma, 3 * PIXELS) * CHANCE
    assert found.variance > 20 * scatter
    assert abs(found.bias_squared) < scatter + 0.02 * found.variance  # the weights have the reference's noise too
    assert found.squared == pytest.approx(found.variance, rel=0.02)


def test_the_uncertainty_is_the_scatter_of_the_mean_square_from_trial_to_trial() -> None:
    """Which differ in their seeds: each of these is off by a brightness of its own, of known scatter."""
    value, sigma, seeds, trials = truth()[:50], 0.1, 4, 400
    brightness = 1 + sigma * rng(9).standard_normal((trials, seeds, 1, 1))
    found = [linear_error(each * value, known_reference(value)) for each in brightness]
    scatter = np.std([each.variance + each.bias_squared for each in found])
    assert np.mean([each.uncertainty**2 for each in found]) ** 0.5 == pytest.approx(scatter, rel=0.2)
    mean = np.mean([each.variance + each.bias_squared for each in found])
    assert mean == pytest.approx(sigma**2 * lit(value), abs=CHANCE * scatter / np.sqrt(trials))


def test_seeds_that_differ_more_in_how_far_they_are_off_are_less_sure() -> None:
    value = truth()
    few, many = (
        linear_error(noisy(each, 0.2, SEEDS, 10), known_reference(each)) for each in (value[: PIXELS // 1000], value)
    )
    assert few.uncertainty > 5 * many.uncertainty
    signs = np.array([1, -1, 1])[:, None, None]
    assert linear_error(value * (1 + 0.1 * signs), known_reference(value)).uncertainty < 1e-12


def test_the_reference_knows_its_own_error() -> None:
    value, sigma = truth(), 0.05
    reference = Reference.of(noisy(value, sigma, PARTS, 5))
    chance = CHANCE * standard_error(sigma, 3 * PIXELS * (PARTS - 1)) / PARTS
    assert reference.error_squared == pytest.approx(sigma**2 * lit(value) / PARTS, abs=chance)
    assert reference.error_squared == pytest.approx(
        known_reference(value).relative(reference.radiance - value), rel=0.1
    )
    assert reference.parts == PARTS


def test_more_parts_make_the_reference_better_in_proportion() -> None:
    value = truth()
    few, many = (Reference.of(noisy(value, 0.1, parts, 6)).error_squared for parts in (4, 16))
    assert few / many == pytest.approx(4, rel=0.1)


def test_parts_alike_have_no_error() -> None:
    value = truth()
    assert Reference.of([value, value, value]).error_squared == 0


def test_errors_do_not_depend_on_the_light() -> None:
    """Nor on the unit that it is in."""
    value = truth()
    renders, parts = noisy(value, 0.2, SEEDS, 7), noisy(value, 0.1, PARTS, 8)
    one, other = (linear_error(k * renders, Reference.of(k * parts)) for k in (1, 1e-12))
    assert one.variance == pytest.approx(other.variance, rel=1e-9)
    assert one.bias_squared == pytest.approx(other.bias_squared, rel=1e-6)


def test_what_is_nearly_black_counts_by_the_floor() -> None:
    value = np.ones((100, 3))
    value[:50] = 0
    floor = FLOOR * value.mean()
    assert known_reference(value).weight[0] == pytest.approx(1 / floor**2)
    assert known_reference(value).weight[-1] == pytest.approx(1 / (1 + floor**2))


def test_a_black_target_has_no_error() -> None:
    dark = np.zeros((2, 10, 3))
    found = linear_error(dark, Reference.of(dark))
    assert (found.variance, found.bias_squared, found.brightness) == (0, 0, 0)


@pytest.mark.parametrize(
    "make", [lambda one: Reference.of(one), lambda one: linear_error(one, known_reference(one[0]))]
)
def test_one_render_tells_no_variance(make) -> None:
    with pytest.raises(InputError, match="at least 2"):
        make(np.ones((1, 10, 3)))
