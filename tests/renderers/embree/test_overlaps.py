"""Overlapping triangles against areas in common that are known, or that OpenCV finds."""

from itertools import combinations

import cv2
import numpy as np
import pytest

from spin_usd.renderers.embree.caster import overlapping
from tests.cases.scenes import pose

LEAST_AREA = 1e-6  # of triangles some tenths long: two of less in common may touch within float32

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]) / 2
HALVES = SQUARE[[[0, 1, 2], [0, 2, 3]]]  # by one diagonal
OTHER_HALVES = SQUARE[[[0, 1, 3], [1, 2, 3]]]  # by the other
LEVEL, ASIDE = np.eye(3), pose((0.9, 0.3, 0.2, 0.1)).rotation


def pairs(*triangles, rotation=LEVEL):
    """The pairs that overlap of all the triangles (N, 3, 3) given, which are numbered through."""
    return set(map(tuple, overlapping(np.concatenate(triangles) @ rotation.T).tolist()))


@pytest.mark.parametrize("rotation", [LEVEL, ASIDE])
@pytest.mark.parametrize("order", [[0, 1, 2], [0, 2, 1]])
def test_halves_of_a_square_overlap_those_of_the_other_diagonal(rotation, order) -> None:
    """Each half overlaps both of the other way, whichever way they face, and not its own other half."""
    assert pairs(HALVES, OTHER_HALVES[:, order], rotation=rotation) == {(0, 2), (0, 3), (1, 2), (1, 3)}


@pytest.mark.parametrize("moved", [(0, 0, 1e-5), (0.5, 0, 0), (0.5, 0.5, 0), (0.25, 0, 0.25)])
def test_what_lies_above_or_beside_does_not_overlap(moved) -> None:
    assert pairs(HALVES, HALVES + moved) == set()


def test_a_triangle_across_another_s_plane_does_not_overlap() -> None:
    assert pairs(HALVES, HALVES @ ASIDE.T) == set()


def test_triangles_of_a_plane_overlap_where_opencv_finds_an_area() -> None:
    """Against the areas in common that OpenCV finds: of the triangles, and of some that are a little larger."""
    rng = np.random.default_rng(5)
    flat = rng.uniform(-0.4, 0.4, (60, 1, 2)) + rng.uniform(-0.15, 0.15, (60, 3, 2))
    found = set(map(tuple, overlapping(np.insert(flat, 2, 0.1, axis=2) @ ASIDE.T).tolist()))
    middle = flat.mean(1, keepdims=True)
    assert common(flat, LEAST_AREA) <= found <= common(middle + 1.01 * (flat - middle), 0.0)
    assert len(found) > 100


def common(flat, least):
    """The pairs of triangles (N, 3, 2) that have more than that area in common."""
    outlines = [cv2.convexHull(triangle.astype(np.float32)) for triangle in flat]
    areas = {
        (i, j): cv2.intersectConvexConvex(outlines[i], outlines[j])[0] for i, j in combinations(range(len(flat)), 2)
    }
    return {pair for pair, area in areas.items() if area > least}
