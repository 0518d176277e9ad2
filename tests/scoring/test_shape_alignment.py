"""A shape that was turned, moved and scaled is laid back where it was, whole or in part, with strays."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from spin_usd.geometry.triangles import spread_points, unit_normals
from spin_usd.scoring.shape_alignment import Similarity, aligned

COUNT = 2500


def craft():
    """Points and normals of a box with two unlike wings, which looks like itself in no other attitude."""
    boxes = [((1, 0.7, 0.8), (0, 0, 0)), ((0.9, 0.02, 0.5), (0.95, 0, 0.1)), ((0.5, 0.02, 0.3), (-0.75, 0.1, 0.2))]
    boxes.append(((0.1, 0.1, 0.6), (0.2, 0.3, 0.7)))
    corners = np.concatenate([trimesh.creation.box(size).triangles + place for size, place in boxes])
    points, face = spread_points(corners, COUNT, np.random.default_rng(0))
    return points, unit_normals(corners[face])


TRUTH, NORMALS = craft()


def moved(points, number, scale=None):
    rng = np.random.default_rng(number)
    scale = 10 ** rng.uniform(-2, 2) if scale is None else scale
    turn = Rotation.random(random_state=number).as_matrix()
    return Similarity(scale, turn, rng.normal(size=3) * 5 * scale).points(points)


def back(points, *, scaled=True):
    move = aligned(points, TRUTH, NORMALS, scaled=scaled, rng=np.random.default_rng(0))
    assert np.linalg.det(move.R) == pytest.approx(1)
    return move.points(points)


@pytest.mark.parametrize("number", range(4))
def test_a_similarity_is_undone(number) -> None:
    np.testing.assert_allclose(back(moved(TRUTH, number)), TRUTH, atol=1e-6)


def test_a_rigid_motion_is_undone_without_a_change_of_size() -> None:
    np.testing.assert_allclose(back(moved(TRUTH, 1, scale=1.0), scaled=False), TRUTH, atol=1e-6)
    small = back(moved(TRUTH, 1, scale=0.5), scaled=False)
    apart, wanted = (np.linalg.norm(each - each[0], axis=1) for each in (small, TRUTH))
    np.testing.assert_allclose(apart, wanted / 2)


def test_noise_and_strays_do_not_lead_astray() -> None:
    rng = np.random.default_rng(3)
    noisy = TRUTH[::2] + rng.normal(scale=0.005, size=(COUNT // 2, 3))
    strays = rng.uniform(-8, 8, (150, 3))
    found = back(moved(np.concatenate([noisy, strays]), 2))[: len(noisy)]
    assert np.linalg.norm(found - TRUTH[::2], axis=1).mean() < 0.02


def test_what_one_side_shows_is_laid_where_it_belongs() -> None:
    seen = TRUTH[(NORMALS @ (0.5, -0.6, 0.6)) > 0]
    found = back(moved(seen, 5))
    assert np.linalg.norm(found - seen, axis=1).mean() < 0.02


def test_a_point_has_no_extent() -> None:
    same = np.ones((10, 3))
    assert aligned(same, TRUTH, NORMALS, scaled=True, rng=np.random.default_rng(0)) is None
    line = np.linspace(0, 1, 10)[:, None] * (1.0, 2, 3)
    move = aligned(line, TRUTH, NORMALS, scaled=True, rng=np.random.default_rng(0))
    assert np.isfinite(move.points(line)).all()
