"""Spreading light: energy, width, linearity, and SciPy's own convolution as authority."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from spin_usd.geometry.camera import Camera
from spin_usd.scene.sensor import Optics
from spin_usd.sensor.develop import convolved, gaussian, spread, through_optics

ENERGY = 1e-4  # what the optics may lose or gain of a point's light
FLOAT32 = 2e-6  # relative: sums of a thousand float32 numbers
KERNEL_TAIL = 1e-6  # of the sum: both kernels are cut at a few standard deviations
SHIFT = 1e-2  # of the local value: how far a wide halo may depend on a point's place on the coarser grids
CAMERA = Camera(width=257, height=190, fx=300, fy=300, cx=128, cy=95)
EVERYTHING = Optics(psf_sigma=1.3, glare=0.2, glare_falloff=4.5, vignetting=(-0.2, 0, 0), cos_fourth=True)


def point(x, y, shape=(190, 257)):
    """Unit light at (x, y) pixels, shared by the four pixels around as their overlap says."""
    image = np.zeros(shape, np.float32)
    column, row = int(x), int(y)
    across, down = x - column, y - row
    image[row : row + 2, column : column + 2] = np.outer([1 - down, down], [1 - across, across])
    return image


def moments(image):
    """Sum, mean position (x, y), and variance along x and y."""
    y, x = np.indices(image.shape)
    weight = image.astype(np.float64)
    total = weight.sum()
    mx, my = (weight * x).sum() / total, (weight * y).sum() / total
    return total, (mx, my), ((weight * (x - mx) ** 2).sum() / total, (weight * (y - my) ** 2).sum() / total)


def seen(image, optics, camera=CAMERA):
    return through_optics(image[..., None], optics, camera, exposure=1.0)[..., 0]


@given(st.floats(1e-6, 400))  # SPEED+'s 0.5 px are 3e-4 px^2 in a picture of 64 px
def test_a_kernel_has_the_asked_sum_and_variance(variance) -> None:
    kernel = gaussian(variance).astype(np.float64)
    n = np.arange(len(kernel)) - len(kernel) // 2
    assert kernel.min() >= 0
    assert kernel.sum() == pytest.approx(1, abs=FLOAT32)
    assert (kernel * n**2).sum() == pytest.approx(variance, rel=2e-5, abs=1e-8)


@given(st.floats(0.1, 6), st.floats(60, 190), st.floats(60, 130))
def test_the_psf_keeps_a_points_energy_and_place(sigma, x, y) -> None:
    before, after = moments(point(x, y)), moments(seen(point(x, y), Optics(psf_sigma=sigma)))
    assert after[0] == pytest.approx(before[0], abs=ENERGY)
    np.testing.assert_allclose(after[1], before[1], atol=1e-3)
    np.testing.assert_allclose(np.subtract(after[2], before[2]), sigma**2, rtol=1e-3, atol=1e-4)


@pytest.mark.parametrize("sigma", [1.5, 4.0])
def test_the_psf_is_scipys_gaussian(sigma) -> None:
    image = np.random.default_rng(0).random((90, 71)).astype(np.float32)
    expected = gaussian_filter(image.astype(np.float64), sigma, mode="constant", truncate=6)
    np.testing.assert_allclose(convolved(image, sigma**2), expected, atol=KERNEL_TAIL)


def test_the_psf_darkens_no_rim() -> None:
    """A uniform picture stays uniform to its edge."""
    flat = np.full((90, 71, 1), 0.25, np.float32)
    np.testing.assert_allclose(seen(flat, Optics(psf_sigma=2.0)), flat, rtol=1e-6)


@pytest.mark.parametrize("variance", [15, 60, 300])
def test_wide_gaussians_on_coarse_grids_are_those_on_the_fine_one(variance) -> None:
    """To a share of the peak, edges included."""
    image = point(30.3, 60.8) + point(150, 90)
    expected = gaussian_filter(image.astype(np.float64), np.sqrt(variance), mode="constant", truncate=7)
    assert np.abs(spread(image, [(variance, 1.0)]) - expected).max() < SHIFT * expected.max()


def test_optics_are_linear() -> None:
    rng = np.random.default_rng(1)
    a, b = (rng.random((190, 257)).astype(np.float32) for _ in range(2))
    together = seen(3 * a + 0.5 * b, EVERYTHING)
    np.testing.assert_allclose(together, 3 * seen(a, EVERYTHING) + 0.5 * seen(b, EVERYTHING), rtol=1e-5, atol=1e-6)


@given(st.integers(-7, 7), st.integers(-7, 7))
def test_optics_do_not_depend_on_the_place(dx, dy) -> None:
    spreading = Optics(psf_sigma=1.3, glare=0.3, glare_falloff=4.5)
    here, there = seen(point(128, 95), spreading), seen(point(128 + dx, 95 + dy), spreading)
    rolled = np.roll(there, (-dy, -dx), (0, 1))[20:-20, 20:-20]
    np.testing.assert_allclose(rolled, here[20:-20, 20:-20], rtol=SHIFT, atol=1e-9)


def test_channels_do_not_mix() -> None:
    colours = np.random.default_rng(2).random((190, 257, 3)).astype(np.float32)
    together = through_optics(colours, EVERYTHING, CAMERA, exposure=1.0)
    for channel in range(3):
        np.testing.assert_allclose(together[..., channel], seen(colours[..., channel], EVERYTHING), rtol=1e-5)


def test_optics_that_do_nothing_cost_nothing() -> None:
    light = np.random.default_rng(3).random((190, 257, 1)).astype(np.float32)
    found = through_optics(light, Optics(), CAMERA, exposure=1.0)
    assert np.shares_memory(found, light)
    assert found.tobytes() == light.tobytes()


def test_the_number_of_threads_changes_no_bit() -> None:
    light = np.random.default_rng(4).random((1000, 1300)).astype(np.float32)
    camera = Camera(width=1300, height=1000, fx=900, fy=900, cx=650, cy=500)
    threads = cv2.getNumThreads()
    try:
        found = []
        for count in (1, 2, 7):
            cv2.setNumThreads(count)
            found.append(seen(light, EVERYTHING, camera).tobytes())
    finally:
        cv2.setNumThreads(threads)
    assert found[0] == found[1] == found[2]
