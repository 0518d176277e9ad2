"""Normals and areas of triangles, against their meaning and Heron's formula."""

import numpy as np
import pytest
import trimesh

from spin_usd.geometry import triangles
from spin_usd.geometry.triangles import areas, distances_to, normals, spread_points, unit_normals

CORNERS = np.random.default_rng(0).standard_normal((4, 25, 3, 3))


def test_normals_are_square_to_the_edges_and_as_long_as_twice_the_area() -> None:
    found = normals(CORNERS)
    edges = np.roll(CORNERS, -1, axis=-2) - CORNERS
    assert np.einsum("...j,...ij->...i", found, edges) == pytest.approx(0, abs=1e-12)
    assert np.linalg.norm(found, axis=-1) == pytest.approx(2 * areas(CORNERS))


def test_corners_go_counter_clockwise_around_the_normal() -> None:
    assert normals(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])) == pytest.approx([0, 0, 1])
    assert normals(CORNERS[..., ::-1, :]) == pytest.approx(-normals(CORNERS))


def test_areas_are_those_of_herons_formula() -> None:
    a, b, c = np.moveaxis(np.linalg.norm(np.roll(CORNERS, -1, axis=-2) - CORNERS, axis=-1), -1, 0)
    s = (a + b + c) / 2
    assert areas(CORNERS) == pytest.approx(np.sqrt(s * (s - a) * (s - b) * (s - c)))


def test_unit_normals_have_length_1_and_none_where_there_is_no_area() -> None:
    assert np.linalg.norm(unit_normals(CORNERS), axis=-1) == pytest.approx(1)
    assert np.cross(unit_normals(CORNERS), normals(CORNERS)) == pytest.approx(0, abs=1e-12)
    assert not unit_normals(np.ones((2, 3, 3))).any()


def test_dot_products_and_lengths_are_numpys_to_the_bit() -> None:
    u, v = CORNERS[..., 0, :], CORNERS[..., 1, :]
    assert np.array_equal(triangles.dot(u, v), (u * v).sum(-1))
    assert np.array_equal(triangles.lengths(CORNERS), np.linalg.norm(CORNERS, axis=-1))


def test_cross_products_are_numpys_to_the_bit() -> None:
    u, v = np.random.default_rng(3).normal(size=(2, 1000, 3)) * 10.0 ** np.arange(-3, 3).reshape(2, 1, 3)
    np.testing.assert_array_equal(triangles.cross(u, v), np.cross(u, v))


def test_how_many_faces_are_looked_at_together_changes_no_bit(monkeypatch) -> None:
    rng = np.random.default_rng(4)
    points, faces = rng.normal(size=(50, 3)), rng.integers(0, 50, (101, 3))
    whole = triangles.normals(points[faces])
    monkeypatch.setattr(triangles, "FACES_AT_ONCE", 7)
    assert [part.stop - part.start for part in triangles.parts(16)] == [7, 7, 2]
    np.testing.assert_array_equal(triangles.normals_of(points, faces), whole)


def test_distances_to_triangles_are_trimeshs() -> None:
    rng = np.random.default_rng(5)
    points, corners = rng.normal(size=(4000, 3)), rng.normal(size=(4000, 3, 3))
    nearest = trimesh.triangles.closest_point(corners, points)
    np.testing.assert_allclose(distances_to(points, corners), np.linalg.norm(points - nearest, axis=1), atol=1e-12)


def test_distances_to_a_triangle_without_area_are_of_its_edges() -> None:
    line = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0.0]])
    points = np.array([[2, 1, 0], [5, 0, 0], [0, 0, 0.0]])
    np.testing.assert_allclose(distances_to(points, np.broadcast_to(line, (3, 3, 3))), [1, 2, 0], atol=1e-12)


def test_points_are_spread_evenly_by_area() -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 5], [3, 0, 5], [0, 3, 5]], [[9, 9, 9]] * 3], float)
    points, face = spread_points(corners, 10_000, np.random.default_rng(0))
    assert np.bincount(face, minlength=3).tolist() == [1000, 9000, 0]
    np.testing.assert_allclose(distances_to(points, corners[face]), 0, atol=1e-12)
    for each in (0, 1):  # a triangle's points have its own middle and moments
        np.testing.assert_allclose(points[face == each].mean(0), corners[each].mean(0), atol=0.05)
        own = (points[face == each] - corners[each][0]) / max(1, 3 * each)
        assert (own[:, 0] * own[:, 1]).mean() == pytest.approx(1 / 12, abs=5e-3)
