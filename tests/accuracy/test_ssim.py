"""Structural ssim by its axioms, and against the definition written out window by window."""

import numpy as np
import pytest

from spin_usd.accuracy.error import K1, K2, RADIUS_PX, SIGMA_PX, ssim

TOP = 255.0


def image(seed, shape=(24, 31)):
    return np.random.default_rng(seed).uniform(0, TOP, shape)


def by_definition(a, b, row, column):
    """Equations 13 to 16 of Wang et al. (2004) for the window around one pixel."""
    steps = np.arange(-RADIUS_PX, RADIUS_PX + 1)
    weights = np.exp(-(steps[:, None] ** 2 + steps[None] ** 2) / (2 * SIGMA_PX**2))
    weights /= weights.sum()
    window = np.s_[row - RADIUS_PX : row + RADIUS_PX + 1, column - RADIUS_PX : column + RADIUS_PX + 1]
    x, y = a[window], b[window]
    mean_x, mean_y = (weights * x).sum(), (weights * y).sum()
    var_x, var_y = (weights * (x - mean_x) ** 2).sum(), (weights * (y - mean_y) ** 2).sum()
    covariance = (weights * (x - mean_x) * (y - mean_y)).sum()
    c1, c2 = (K1 * TOP) ** 2, (K2 * TOP) ** 2
    luminance = (2 * mean_x * mean_y + c1) / (mean_x**2 + mean_y**2 + c1)
    return luminance * (2 * covariance + c2) / (var_x + var_y + c2)


def test_it_is_what_its_definition_says() -> None:
    a, b = image(0), image(1) * 0.3 + image(0) * 0.7
    found = ssim(a, b, top=TOP)
    for row, column in ((5, 5), (12, 20), (18, 25)):
        assert found[row, column] == pytest.approx(by_definition(a, b, row, column), rel=1e-9)


def test_an_image_is_like_itself() -> None:
    assert ssim(image(2), image(2), top=TOP) == pytest.approx(1)


def test_it_is_symmetric_and_at_most_one() -> None:
    a, b = image(3), image(4)
    assert ssim(a, b, top=TOP) == pytest.approx(ssim(b, a, top=TOP))
    assert ssim(a, b, top=TOP).max() < 1


def test_what_is_far_away_does_not_matter() -> None:
    a, b = image(5), image(5)
    b[0, 0] += 100
    found = ssim(a, b, top=TOP)
    assert found[RADIUS_PX + 1 :] == pytest.approx(1)
    assert found[0, 0] < 1


def test_it_does_not_depend_on_the_unit() -> None:
    a, b = image(6), image(7)
    assert ssim(a, b, top=TOP) == pytest.approx(ssim(257 * a, 257 * b, top=257 * TOP))


def test_more_noise_is_less_alike() -> None:
    a, noise = image(8), image(9) - TOP / 2
    alike = [ssim(a, a + k * noise, top=TOP).mean() for k in (0.1, 0.3, 1.0)]
    assert alike == sorted(alike, reverse=True)


def test_channels_are_averaged() -> None:
    a, b = image(10, (20, 20, 3)), image(11, (20, 20, 3))
    each = [ssim(a[..., i], b[..., i], top=TOP) for i in range(3)]
    assert ssim(a, b, top=TOP) == pytest.approx(np.mean(each, 0))
