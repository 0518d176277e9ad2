"""The fit of light: planted strengths come back, also from saturated pictures and among many lights."""

import numpy as np
import pytest
from scipy.optimize import nnls

from spin_usd.realism.light_fit import fit_light
from spin_usd.realism.picture_view import smoothed
from tests.cases.drawn_pictures import ellipse

SIZE = (96, 128)
MASK = ellipse(SIZE, 0.45)
NOWHERE = np.zeros(SIZE, bool)
NOISE = 0.01
NONE = np.zeros(3, bool)


def lights(count, seed=0):
    """(count, H, W) renders of as many lights: smooth, not negative, alike in places."""
    rng = np.random.default_rng(seed)
    fields = [smoothed(rng.standard_normal(SIZE).astype(np.float32), 8) for _ in range(count)]
    return np.stack([np.clip(field / field.std(), 0, None) for field in fields])


def picture(basis, strengths, seed=0, noise=NOISE):
    chance = np.random.default_rng(1000 + seed).standard_normal(SIZE)
    return np.asarray(np.tensordot(strengths, basis, 1) + noise * chance, np.float32)


def fitted(basis, signal, mask=MASK, full=NOWHERE, *, sparse=False):
    """The fit with renders without noise."""
    return fit_light(np.stack([basis, basis]).astype(np.float32), signal, mask, full, spare=np.full(len(basis), sparse))


def test_a_known_mix_comes_back() -> None:
    basis, strengths = lights(5), np.array([0.7, 0.0, 1.3, 0.4, 0.0])
    found = fitted(basis, picture(basis, strengths), sparse=True)
    assert found.strengths == pytest.approx(strengths, abs=0.02)
    assert (found.low <= found.strengths).all()
    assert (found.strengths <= found.high).all()


def test_the_fit_is_scipys() -> None:
    """Of lights that all shine: the non-negative least squares of the pixels themselves."""
    basis, strengths = lights(4), np.array([0.7, 0.9, 1.3, 0.4])
    signal = picture(basis, strengths, noise=0.2)
    expected, _ = nnls(basis[:, MASK].T.astype(float), signal[MASK].astype(float))
    assert fitted(basis, signal).strengths == pytest.approx(expected, rel=1e-6)


def test_only_the_mask_counts() -> None:
    basis, strengths = lights(3), np.array([0.7, 0.9, 0.3])
    signal = picture(basis, strengths)
    bright = np.where(MASK, signal, 50).astype(np.float32)
    one, other = (fitted(basis, each).strengths for each in (signal, bright))
    assert one.tolist() == other.tolist()


@pytest.mark.parametrize("quantile", [0.6, 0.9])
def test_saturated_pixels_are_lower_bounds(quantile) -> None:
    """Strengths come back from a picture of which 40 % are cut off; as plain values these pixels would take 10 % away
    and more."""
    basis, strengths = lights(4, seed=2), np.array([1.0, 0.5, 0.8, 0.6])
    signal = picture(basis, strengths)
    top = np.quantile(signal[MASK], quantile)
    cut, full = np.minimum(signal, top), signal >= top
    assert fitted(basis, cut, MASK, full).strengths == pytest.approx(strengths, abs=0.04)
    taken_as_is = fitted(basis, cut).strengths
    assert np.abs(taken_as_is - strengths).max() > 0.05


def test_a_light_that_shines_on_saturated_pixels_alone_is_kept_strong_enough() -> None:
    """Where a picture is full, more light than that is wanted, and no more is known."""
    basis = np.zeros((2, *SIZE), np.float32)
    basis[0, :, :64], basis[1, :, 64:] = 1, 1
    signal = np.where(np.arange(SIZE[1]) < 64, 0.3, 1.0) * np.ones(SIZE)
    found = fitted(basis, signal.astype(np.float32), MASK, signal >= 1).strengths
    assert found[0] == pytest.approx(0.3, abs=1e-3)
    assert found[1] > 0.99


def test_a_picture_that_is_full_everywhere_is_fitted_as_it_is() -> None:
    basis = lights(2)
    full = np.ones(SIZE, np.float32)
    assert (fitted(basis, full, MASK, MASK).strengths > 0).any()


def test_no_light_no_pixel_no_strength() -> None:
    basis = lights(3)
    dark = fitted(basis, np.zeros(SIZE, np.float32))
    assert dark.strengths.tolist() == [0, 0, 0]
    assert fitted(np.zeros((3, *SIZE), np.float32), picture(basis, np.ones(3))).strengths.sum() == 0
    assert fitted(basis, picture(basis, np.ones(3)), NOWHERE, NOWHERE).strengths.tolist() == [0, 0, 0]
    none = fitted(np.zeros((0, *SIZE), np.float32), np.ones(SIZE, np.float32))
    assert none.strengths.shape == none.low.shape == none.high.shape == (0,)


def test_few_lights_of_many_are_kept() -> None:
    """Two of forty shine: five remain at most, and the two have nine tenths of the strength."""
    basis = lights(40, seed=3)
    for seed in range(5):
        planted = np.random.default_rng(seed).choice(40, 2, replace=False)
        strengths = np.zeros(40)
        strengths[planted] = 0.9, 0.6
        found = fitted(basis, picture(basis, strengths, seed, noise=0.1), sparse=True).strengths
        assert (found > 0).sum() <= 5
        assert found[planted].sum() > 0.9 * found.sum()


def test_the_stages_own_lights_are_all_kept() -> None:
    """Of lights that are known to be there none is left out because it is weak."""
    basis, strengths = lights(4), np.array([1.0, 0.8, 0.03, 0.02])
    signal = picture(basis, strengths)
    assert fitted(basis, signal).strengths == pytest.approx(strengths, abs=0.01)
    assert (fitted(basis, signal, sparse=True).strengths > 0).sum() == 2


def test_a_light_that_is_not_spare_is_kept_however_weak() -> None:
    """Such as a room's, which fills the shadows of one that is a hundred times as strong."""
    basis, strengths = lights(6), np.array([1.0, 0, 0, 0, 0.01, 0])
    spare = np.array([True] * 4 + [False] * 2)
    found = fit_light(np.stack([basis, basis]), picture(basis, strengths, noise=0.001), MASK, NOWHERE, spare=spare)
    assert found.strengths == pytest.approx(strengths, abs=2e-3)
    assert found.strengths[4] > 0
    assert found.strengths[[1, 2, 3]].tolist() == [0, 0, 0]


def test_a_room_does_not_take_the_place_of_a_light() -> None:
    """What is not spare joins the lights that were chosen without it."""
    basis = lights(5, seed=6)
    basis[4] = 0.8 * basis[0] + 0.2 * basis[1]  # much like the one that shines
    spare, strengths = np.array([True] * 4 + [False]), np.array([1.0, 0, 0, 0, 0.05])
    found = fit_light(np.stack([basis, basis]), picture(basis, strengths), MASK, NOWHERE, spare=spare)
    assert found.strengths[0] == pytest.approx(1, abs=0.1)
    assert found.strengths[4] < 0.2


def test_the_noise_of_renders_biases_nothing() -> None:
    """Errors in variables: with one noisy render for both of the two, strengths are too small by the noise's share of
    its squares, a fifth here; with two of noise of their own they are not."""
    basis, strengths = lights(3, seed=4), np.array([0.8, 0.6, 0.5])
    spread = 0.5 * np.sqrt(np.square(basis[:, MASK]).mean())
    twice, once = [], []
    for seed in range(12):
        chance = spread * np.random.default_rng(seed).standard_normal((2, *basis.shape))
        two = (basis + chance).astype(np.float32)
        signal = picture(basis, strengths, seed)
        twice.append(fit_light(two, signal, MASK, NOWHERE, spare=NONE).strengths)
        once.append(fit_light(two[[0, 0]], signal, MASK, NOWHERE, spare=NONE).strengths)
    error = 3 * np.std(twice, axis=0) / len(twice) ** 0.5
    assert np.mean(twice, axis=0) == pytest.approx(strengths, abs=float(error.max()) + 0.005)
    assert (np.mean(once, axis=0) / strengths).mean() < 0.9


def test_the_order_of_the_two_renders_does_not_matter() -> None:
    basis = lights(3)
    two = np.stack([basis, basis + 0.1 * lights(3, seed=9)])
    signal = picture(basis, np.array([0.7, 0.9, 0.3]))
    one, other = (fit_light(each, signal, MASK, NOWHERE, spare=NONE).strengths for each in (two, two[::-1]))
    assert one == pytest.approx(other)


@pytest.mark.parametrize(("sigma", "least"), [(0.0, 0.85), (2.0, 0.75)])
def test_the_interval_holds_what_was_planted(sigma, least) -> None:
    """In 95 of 100 in theory. Fewer do: a bootstrap of some twenty tiles is too sure of itself, the more so if errors
    are alike over several pixels; the interval of a picture is a guide and no proof."""
    basis, strengths = lights(3, seed=5), np.array([0.8, 0.6, 0.5])
    holding = 0
    for seed in range(20):
        chance = np.random.default_rng(seed).standard_normal(SIZE).astype(np.float32)
        chance = smoothed(chance, sigma) if sigma else chance
        signal = np.asarray(np.tensordot(strengths, basis, 1) + 0.1 * chance / chance.std(), np.float32)
        found = fitted(basis, signal)
        holding += int(((found.low <= strengths) & (strengths <= found.high)).sum())
    assert holding >= least * 20 * len(strengths)
