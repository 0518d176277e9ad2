"""Edges: the spread of edges blurred by a known Gaussian, and silhouettes shifted by known distances."""

from functools import cache

import cv2
import numpy as np
import pytest

from spin_usd.realism.edges import edge_spread, sampled, silhouette_offsets
from tests.cases.drawn_pictures import ellipse, polygons, written

SIZE = (256, 320)
PIXEL = 1 / 12  # variance of a pixel's own width
EVERYWHERE = np.ones(SIZE, bool)


@cache
def shapes():
    return polygons(0, 16, SIZE)


def blurred(sigma, *, height=150.0, level=30.0):
    signal = height * (cv2.GaussianBlur(shapes(), (0, 0), sigma) if sigma else shapes())
    return (level + signal).astype(np.float32)


@pytest.mark.parametrize("sigma", [0.5, 0.8, 1.2, 1.8, 2.4])
def test_the_spread_is_of_blur_and_pixel_together(sigma) -> None:
    """Variances add up. The sharpest edges count, and the grid of widths is 8 % wide: 15 %."""
    assert edge_spread(blurred(sigma), EVERYWHERE, 0.0) == pytest.approx((sigma**2 + PIXEL) ** 0.5, rel=0.15)


def test_the_sharpest_edges_are_those_of_a_pixel() -> None:
    """Without any blur the interpolation between pixels adds its own to the pixel's 0.29: a third of a pixel."""
    assert PIXEL**0.5 < edge_spread(blurred(0), EVERYWHERE, 0.0) < (PIXEL + 1 / 9) ** 0.5


def test_the_spread_rises_with_the_blur() -> None:
    found = [edge_spread(blurred(sigma), EVERYWHERE, 0.0) for sigma in (0, 0.4, 0.7, 1, 1.4, 2, 2.8)]
    assert (np.diff(found) > 0).all()


def test_noise_hides_no_edge_but_the_dim() -> None:
    for seed in range(5):
        grey = written(blurred(1.2, level=0), level=30, noise=4, seed=seed)
        assert edge_spread(grey, EVERYWHERE, 4.0) == pytest.approx((1.2**2 + PIXEL) ** 0.5, rel=0.2)
    dim = blurred(1.2, height=20)
    assert np.isnan(edge_spread(dim, EVERYWHERE, 4.0))
    assert np.isfinite(edge_spread(dim, EVERYWHERE, 1.0))


def test_noise_is_averaged_along_an_edge() -> None:
    """Of an edge that is 15 times as high as the noise one profile in two fits no Gaussian; the mean of five does."""
    spreads = []
    for seed in range(5):
        grey = written(blurred(1.2, height=90, level=0), level=30, noise=6, seed=seed)
        spreads.append(edge_spread(grey, EVERYWHERE, 6.0))
    assert np.median(spreads) == pytest.approx((1.2**2 + PIXEL) ** 0.5, rel=0.2)


def test_the_level_and_the_sign_do_not_matter() -> None:
    grey = blurred(1.0)
    spread = edge_spread(grey, EVERYWHERE, 0.0)
    assert edge_spread(grey + 20, EVERYWHERE, 0.0) == pytest.approx(spread, rel=1e-3)
    assert edge_spread(200 - grey, EVERYWHERE, 0.0) == pytest.approx(spread, rel=0.1)


def test_a_cut_off_edge_does_not_count() -> None:
    assert np.isnan(edge_spread(np.minimum(blurred(2.0, height=900), 255), EVERYWHERE, 0.0))


def test_outside_the_mask_nothing_counts() -> None:
    assert np.isnan(edge_spread(blurred(1.0), np.zeros(SIZE, bool), 0.0))


@pytest.mark.parametrize("pixels", [-5, -2, 0, 1, 3, 6])
def test_a_shifted_silhouette_comes_back(pixels) -> None:
    """The picture's target is larger than the labels' by that many pixels on all sides: outwards is positive."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] - np.array([SIZE[0], SIZE[1]])[:, None, None] / 2 + 0.5
    radius = 80.0
    mask = np.hypot(x, y) < radius
    inside = np.clip(radius + pixels - np.hypot(x, y) + 0.5, 0, 1)
    found = silhouette_offsets((30 + 150 * inside).astype(np.float32), mask, 0.0)
    assert found.median == pytest.approx(pixels, abs=0.5)  # the step of a profile
    assert found.spread <= 0.5
    assert found.edges == found.searched


def test_a_silhouette_that_is_moved_sideways_has_spread_and_no_offset() -> None:
    mask = ellipse(SIZE)
    moved = np.roll(mask, 5, axis=1)
    found = silhouette_offsets((30 + 150.0 * moved).astype(np.float32), mask, 0.0)
    assert abs(found.median) <= 1
    assert found.spread >= 2


def test_a_picture_without_a_target_has_no_edges() -> None:
    found = silhouette_offsets(written(np.zeros(SIZE), level=30, noise=5, seed=0), ellipse(SIZE), 5.0)
    assert found.edges < 0.1 * found.searched
    empty = silhouette_offsets(np.zeros(SIZE, np.float32), np.zeros(SIZE, bool), 0.0)
    assert np.isnan(empty.median)
    assert (empty.edges, empty.searched) == (0, 0)


def test_the_frames_edge_is_no_silhouette() -> None:
    assert silhouette_offsets(np.zeros(SIZE, np.float32), np.ones(SIZE, bool), 0.0).searched == 0


def test_profiles_are_sampled_along_their_lines() -> None:
    """A linear picture is interpolated by cubics to 5 % of a pixel's step: OpenCV's kernel is of a = -0.75."""
    y, x = np.mgrid[:40, :60]
    grey = (2.0 * x + 0.5 * y).astype(np.float32)
    at, along = np.array([[20.0, 15], [30, 22]]), np.array([[0.6, 0.8], [1, 0]])
    offsets = np.arange(-3, 3.5, 0.5)
    places = at[:, None] + along[:, None] * offsets[:, None]
    assert sampled(grey, at, along, offsets) == pytest.approx(2 * places[..., 0] + 0.5 * places[..., 1], abs=0.05 * 2.5)
    assert sampled(grey, np.zeros((0, 2)), np.zeros((0, 2)), offsets).shape == (0, len(offsets))
