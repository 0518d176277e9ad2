"""Normals and areas of triangles, against their meaning and Heron's formula."""

import numpy as np
import pytest

from spin_usd.geometry import triangles
from spin_usd.geometry.triangles import areas, normals, unit_normals

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
