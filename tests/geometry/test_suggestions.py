"""Suggestions: far apart, reproducible from a seed, and none twice."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from spin_usd.commands.keypoints.suggestions import random_directions, spread, spread_and_seen

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)


def rng(seed=3):
    return np.random.default_rng(seed)


def test_the_corners_of_a_cube_are_farther_apart_than_what_lies_between() -> None:
    between = np.random.default_rng(1).uniform(0.2, 0.8, (50, 3))
    chosen = spread(np.concatenate([CUBE, between]), 9, np.random.default_rng(8))
    assert set(range(8)) <= set(chosen.tolist())


def test_each_is_as_far_from_those_before_as_any_is() -> None:
    points = np.random.default_rng(2).normal(size=(200, 3))
    chosen = points[spread(points, 12, rng())]
    for place in range(1, len(chosen)):
        apart = np.linalg.norm(points[:, None] - chosen[None, :place], axis=-1).min(1)
        assert np.linalg.norm(chosen[place] - chosen[:place], axis=1).min() == pytest.approx(apart.max())


def test_a_seed_decides_all() -> None:
    points = np.random.default_rng(2).normal(size=(200, 3))
    assert (spread(points, 12, rng()) == spread(points, 12, rng())).all()
    assert (random_directions(9, rng()) == random_directions(9, rng())).all()
    assert len({spread(points, 12, rng(seed)).tobytes() for seed in range(5)}) > 1


def test_points_that_coincide_are_taken_once() -> None:
    chosen = spread(np.concatenate([CUBE, CUBE]), 20, rng())
    assert len(chosen) == 8
    assert pdist(np.concatenate([CUBE, CUBE])[chosen]).min() > 0


def test_what_no_view_shows_is_not_suggested() -> None:
    share = np.array([0.5, 0.9, 0, 0, 0.4, 0, 0.3, 0])
    assert set(spread_and_seen(CUBE, share, 8).tolist()) == {0, 1, 4, 6}
    assert spread_and_seen(CUBE, share, 8)[0] == 1


def test_random_directions_are_spread_evenly() -> None:
    directions = random_directions(20_000, rng())
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    assert directions.mean(0) == pytest.approx(0, abs=0.02)
    assert (directions**2).mean(0) == pytest.approx(1 / 3, abs=0.01)
