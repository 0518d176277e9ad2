"""Convex bodies, against what convexity means: the segment between any two points of the body stays within it."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from spin_usd.scene.mesh import is_convex
from tests.cases import scenes


def hull(seed, count=40):
    """A random convex body: (points, faces), faces turned any way."""
    points = np.random.default_rng(seed).standard_normal((count, 3))
    return points, ConvexHull(points).simplices


def subdivided(points, faces):
    """Each face as four, which leaves the shape."""
    a, b, c = np.moveaxis(points[faces], 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    corners = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)


@pytest.mark.parametrize("seed", range(5))
def test_hulls_are_convex_however_they_are_turned_split_scaled_and_placed(seed) -> None:
    points, faces = hull(seed)
    assert is_convex(points, faces)
    assert is_convex(points, faces[:, ::-1])
    assert is_convex(*subdivided(points, faces))
    assert is_convex(1e-3 * points + 1e3, faces)


@pytest.mark.parametrize("seed", range(5))
def test_a_hull_with_a_dent_a_hole_a_lump_or_a_skin_is_not(seed) -> None:
    points, faces = hull(seed)
    used = np.unique(faces)
    dented = points.copy()
    dented[used[0]] *= 0.2
    assert not is_convex(dented, faces)
    assert not is_convex(points, faces[1:])
    assert not is_convex(points, np.concatenate([faces, faces]))
    assert not is_convex(points, np.concatenate([faces, faces[:1], faces[:1, ::-1]]))
    outer, inner = 3 * points, points
    assert not is_convex(np.concatenate([outer, inner]), np.concatenate([faces, faces + len(points)]))
    assert not is_convex(np.concatenate([points, points + 9]), np.concatenate([faces, faces + len(points)]))


def test_boxes_are_and_what_is_open_or_flat_is_not() -> None:
    points, faces = scenes.box()
    assert is_convex(points, faces)
    assert not is_convex(points, faces[:10])
    assert not is_convex(points, faces[:2])
    assert not is_convex(points, np.concatenate([faces[:2], faces[:2, ::-1]]))  # a sheet of two sides


def test_two_boxes_that_touch_are_not() -> None:
    (a, faces), (b, _) = scenes.box(), scenes.box((0.5, -0.5, -0.5), (1.5, 0.5, 0.5))
    assert not is_convex(np.concatenate([a, b]), np.concatenate([faces, faces + 8]))
