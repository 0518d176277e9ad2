"""The classifier two-sample test: chance where both sets are of one distribution, and certainty where they are not."""

import numpy as np
import pytest

from spin_usd.realism.two_sample import LEAST_PICTURES, MOST_PATCHES, area, patch_features, separability
from tests.cases.drawn_pictures import ellipse, view, written

SIZE = (240, 320)
TARGET = ellipse(SIZE, 0.45)


def features(seed, noise, sigma=20.0):
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    signal = np.where(TARGET, 60 + 40 * np.sin(x / sigma) * np.cos(y / sigma), 0)
    return patch_features(view(written(signal, level=30, noise=noise, seed=seed), TARGET))


def test_sets_of_one_distribution_are_not_told_apart() -> None:
    """Four standard deviations of the area of N and N independent scores: (2 N + 1) / (12 N²) is its variance (Mann and
    Whitney, 1947)."""
    real, ours = ([features(seed, 4.0) for seed in range(first, first + 10)] for first in (0, 100))
    found, areas = separability(real, ours)
    count = sum(map(len, real))
    assert abs(found - 0.5) < 4 * ((2 * count + 1) / (12 * count**2)) ** 0.5
    assert np.isfinite(areas).all()
    assert abs(areas.mean() - 0.5) < 0.1


@pytest.mark.parametrize("other", [{"noise": 6.0}, {"noise": 4.0, "sigma": 6.0}])
def test_sets_of_other_noise_or_texture_are_told_apart(other) -> None:
    real, ours = [features(seed, 4.0) for seed in range(6)], [features(seed, **other) for seed in range(100, 106)]
    found, areas = separability(real, ours)
    assert found > 0.9
    assert areas.min() > 0.8


def test_patches_come_from_places_of_the_mask_alone() -> None:
    one, other = features(0, 4.0), features(1, 9.0)
    assert one.shape == other.shape
    assert 0 < len(one) <= MOST_PATCHES
    assert patch_features(view(np.zeros(SIZE), np.zeros(SIZE, bool))).shape[0] == 0


def test_few_pictures_or_none_say_nothing() -> None:
    few = [features(seed, 4.0) for seed in range(LEAST_PICTURES - 1)]
    found, areas = separability(few, few)
    assert np.isnan(found)
    assert np.isnan(areas).all()
    without = np.zeros((0, 0))
    enough = [features(seed, 4.0) for seed in range(LEAST_PICTURES)]
    _, areas = separability([*enough, without], [*enough, enough[0]])
    assert np.isnan(areas).tolist() == [*[False] * LEAST_PICTURES, True]


def test_the_area_is_the_share_of_pairs_in_the_right_order() -> None:
    """By counting all pairs, ties half."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        scores, positive = rng.integers(0, 6, 30).astype(float), (rng.random(30) < 0.4).astype(float)
        ours, real = scores[positive > 0], scores[positive == 0]
        counted = (ours[:, None] > real).sum() + 0.5 * (ours[:, None] == real).sum()
        assert area(scores, positive) == pytest.approx(counted / (len(ours) * len(real)), abs=1e-12)
