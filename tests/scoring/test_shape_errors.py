"""Distances of shapes by their laws, and by trimesh's and scipy's own nearest points."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from spin_usd.scoring.shape_errors import picture_errors, shape_errors, share_within, similarity
from spin_usd.scoring.shape_surface import ScoredSurface

COUNT = 5000
FACET = 1e-6  # metres that a point may seem off its facet, among many small ones
RNG = np.random.default_rng(0)


def surface(corners) -> ScoredSurface:
    return ScoredSurface.of_triangles(np.asarray(corners, float), COUNT, np.random.default_rng(1))


def errors(found, truth):
    return shape_errors(found, truth, truth.points, truth.normals)


def plane(height=0.0):
    """A plane of 4 x 4 m at this height, in two triangles."""
    a, b, c, d = ([-2, -2, height], [2, -2, height], [2, 2, height], [-2, 2, height])
    return surface([[a, b, c], [a, c, d]])


def sphere(radius):
    return surface(trimesh.creation.icosphere(subdivisions=4, radius=radius).triangles)


def test_a_surface_is_at_no_distance_from_itself() -> None:
    found = errors(sphere(1.0), sphere(1.0))
    assert found.chamfer == pytest.approx(0, abs=FACET)
    assert found.f_score(1e-2) == 1
    assert found.agreement == pytest.approx(1, abs=1e-6)


def test_a_plane_moved_along_its_normal_is_as_far_everywhere() -> None:
    found = errors(plane(0.037), plane())
    np.testing.assert_allclose(found.accuracy, 0.037)
    np.testing.assert_allclose(found.completeness, 0.037)
    assert found.chamfer == pytest.approx(0.037)
    assert (found.f_score(0.036), found.f_score(0.038)) == (0, 1)


@pytest.mark.parametrize("change", [-0.2, 0.01, 0.3])
def test_a_sphere_of_another_radius_is_off_by_the_difference(change) -> None:
    assert errors(sphere(1 + change), sphere(1.0)).chamfer == pytest.approx(abs(change), abs=2e-3)  # of the facets


def test_a_half_is_accurate_and_not_complete() -> None:
    whole = sphere(1.0)
    half = surface(whole.corners[whole.corners[..., 2].min(1) >= 0])
    found = errors(half, whole)
    assert found.accuracy.mean() == pytest.approx(0, abs=FACET)
    assert share_within(found.completeness, 1e-3) == pytest.approx(0.5, abs=0.02)
    heights = np.linspace(0, 1, 100_001)  # of the missing half: area goes with height
    rim = np.sqrt((1 - np.sqrt(1 - heights**2)) ** 2 + heights**2)  # its distance from the half's edge
    assert found.completeness.mean() == pytest.approx(rim.mean() / 2, rel=0.03)  # facets have another edge


def test_the_f_score_grows_with_the_threshold() -> None:
    cloud = ScoredSurface(points=sphere(1.0).points + RNG.normal(scale=0.05, size=(COUNT, 3)), normals=None)
    found = errors(cloud, sphere(1.0))
    scores = [found.f_score(threshold) for threshold in np.linspace(0, 0.3, 40)]
    assert scores == sorted(scores)
    assert (scores[0], scores[-1]) == (0, 1)
    assert found.agreement is None


def test_a_clouds_distances_are_scipys() -> None:
    one, other = RNG.normal(size=(500, 3)), RNG.normal(size=(700, 3))
    found = errors(ScoredSurface(points=one, normals=None), ScoredSurface(points=other, normals=other))
    np.testing.assert_allclose(found.accuracy, KDTree(other).query(one)[0])
    np.testing.assert_allclose(found.completeness, KDTree(one).query(other)[0])


def test_distances_of_a_mesh_with_slivers_are_exact() -> None:
    thin = RNG.uniform(-1, 1, (300, 1, 3)) + RNG.normal(size=(300, 3, 3)) * (1, 1e-3, 1e-3)
    whole = surface(np.concatenate([thin, trimesh.creation.box((1, 1, 1)).triangles]))
    points = RNG.normal(size=(300, 3))
    found, _ = whole.nearest(points)
    every = np.repeat(points, len(whole.corners), axis=0)
    nearest = trimesh.triangles.closest_point(np.tile(whole.corners, (len(points), 1, 1)), every)
    exact = np.linalg.norm(every - nearest, axis=1).reshape(len(points), -1).min(1)
    np.testing.assert_allclose(found, exact, atol=2e-3)
    assert np.mean(np.isclose(found, exact, atol=1e-9)) > 0.97


def test_equal_pictures_are_alike_and_noise_has_the_psnr_of_its_strength() -> None:
    image = RNG.integers(0, 256, (60, 70, 3), np.uint8)
    mask = np.zeros((60, 70), bool)
    mask[10:50, 10:60] = True
    assert picture_errors(image, image, mask) == (np.inf, 1)
    off = image.astype(int) + np.where(image > 127, -10, 10)
    psnr, ssim = picture_errors(off.astype(np.uint8), image, mask)
    assert psnr == pytest.approx(20 * np.log10(255 / 10))
    assert 0.5 < ssim < 1
    outside = image.copy()
    outside[~mask] = 0
    assert picture_errors(outside, image, mask) == (np.inf, 1)  # only the mask counts


def test_the_map_is_wangs_formula() -> None:
    one, other = RNG.random((40, 50, 1)), RNG.random((40, 50, 1))
    row, column = 20, 30
    x = np.arange(-5, 6)
    window = np.exp(-(x[:, None] ** 2 + x**2) / (2 * 1.5**2))
    window /= window.sum()
    a, b = (each[row - 5 : row + 6, column - 5 : column + 6, 0] for each in (one, other))
    mean_a, mean_b = (window * a).sum(), (window * b).sum()
    var_a, var_b = (window * (a - mean_a) ** 2).sum(), (window * (b - mean_b) ** 2).sum()
    both = (window * (a - mean_a) * (b - mean_b)).sum()
    c, d = 0.01**2, 0.03**2
    wanted = (2 * mean_a * mean_b + c) * (2 * both + d) / ((mean_a**2 + mean_b**2 + c) * (var_a + var_b + d))
    assert similarity(one, other)[row, column, 0] == pytest.approx(wanted)
