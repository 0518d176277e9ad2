"""A part's root is where it meets its craft; its axes are those of its shape."""

import numpy as np
import pytest
import trimesh

from spin_usd.geometry.part_axes import PartAxes, nearest

NONE = np.zeros((0, 3, 3))


def box(size, centre, turned=0.0):
    made = trimesh.creation.box(size)
    made.apply_transform(trimesh.transformations.rotation_matrix(turned, (0, 0, 1)))
    made.apply_translation(centre)
    return np.asarray(made.triangles, np.float64)


BODY = box((1, 1, 1), (0, 0, 0))


@pytest.mark.parametrize("gap", [0.0, 0.02])
def test_a_wing_is_rooted_in_the_middle_of_its_edge(gap) -> None:
    wing = box((2, 0.6, 0.02), (1.5 + gap, 0.1, 0.2))
    axes = PartAxes.of(wing, BODY)
    np.testing.assert_allclose(axes.root, (0.5 + gap, 0.1, 0.2), atol=1e-12)
    np.testing.assert_allclose(axes.longest, (1, 0, 0), atol=1e-9)
    frame, length = axes.bend_frame(axes.length)
    np.testing.assert_allclose(frame[:3, [0, 2, 3]].T, [[1, 0, 0], [0, 0, 1], axes.root], atol=1e-9)
    assert length == pytest.approx(2)


def test_a_boom_in_the_middle_of_a_panel_is_its_root() -> None:
    boom, panel = box((0.5, 0.05, 0.05), (0.75, 0, 0)), box((0.02, 3, 1), (1.01, 0, 0))
    axes = PartAxes.of(panel, np.concatenate([BODY, boom]))
    np.testing.assert_allclose(axes.root, (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(np.abs(axes.longest), (0, 1, 0), atol=1e-9)


def test_a_wing_on_its_longer_edge_turns_about_that_and_bends_away_from_it() -> None:
    axes = PartAxes.of(box((0.4, 0.02, 0.8), (0.7, 0, 0)), BODY)
    np.testing.assert_allclose(axes.longest, (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(np.abs(axes.length), (1, 0, 0), atol=1e-9)
    frame, length = axes.bend_frame(axes.length)
    np.testing.assert_allclose(frame[:3, 0], (1, 0, 0), atol=1e-9)
    assert length == pytest.approx(0.4)


def test_a_slanted_rod_has_its_own_direction_outwards() -> None:
    rod = box((3, 0.01, 0.01), (0, 0, 0), turned=np.radians(150)) + np.array([-1.8, 0.75, 0])
    np.testing.assert_allclose(PartAxes.of(rod, BODY).longest, (-np.cos(np.pi / 6), 0.5, 0), atol=1e-6)


def test_equal_widths_are_decided_by_the_body_axes() -> None:
    axes = PartAxes.of(box((1, 1, 1), (0, 0, 0)), NONE)
    np.testing.assert_allclose(axes.longest, (1, 0, 0), atol=1e-9)
    np.testing.assert_allclose(axes.root, 0, atol=1e-12)


def test_distances_are_those_of_trimesh() -> None:
    mesh = trimesh.creation.icosphere(2)
    points = np.random.default_rng(0).normal(size=(40, 3))
    away, face = nearest(points, np.asarray(mesh.triangles))
    expected = trimesh.triangles.closest_point(
        np.repeat(np.asarray(mesh.triangles), len(points), axis=0), np.tile(points, (len(mesh.faces), 1))
    )
    each = np.linalg.norm(expected.reshape(len(mesh.faces), len(points), 3) - points, axis=2)
    np.testing.assert_allclose(away, each.min(0), atol=1e-12)
    np.testing.assert_allclose(each[face, np.arange(len(points))], each.min(0), atol=1e-12)
