"""Directions spread evenly: what the area of a sphere says of their means, and how far any direction is from them."""

import numpy as np
import pytest

from spin_usd.geometry.directions import half_sphere, sphere

COUNTS = (64, 128, 1000)
EVEN = 1.5  # in the radii of `farthest`: a hexagonal grid has 1.1, chance 2.4
ANYWHERE = np.random.default_rng(0).standard_normal((500, 3))
ANYWHERE /= np.linalg.norm(ANYWHERE, axis=1)[:, None]


def farthest(directions, count):
    """The largest angle from anywhere to the nearest of `directions`, in radii of caps that share the sphere among
    `count`."""
    return np.arccos((ANYWHERE @ directions.T).max(1).clip(-1, 1)).max() / np.arccos(1 - 2 / count)


@pytest.mark.parametrize("count", COUNTS)
def test_a_sphere_looks_all_around_evenly(count) -> None:
    ways = sphere(count)
    assert np.linalg.norm(ways, axis=1) == pytest.approx(1)
    assert ways.mean(0) == pytest.approx(0, abs=1 / count)
    assert ways.T @ ways / count == pytest.approx(np.eye(3) / 3, abs=2 / count)
    assert farthest(ways, count) < EVEN


@pytest.mark.parametrize("count", COUNTS)
def test_a_half_sphere_and_its_opposite_look_all_around_evenly(count) -> None:
    ways = half_sphere(count)
    assert np.linalg.norm(ways, axis=1) == pytest.approx(1)
    assert (ways[:, 2] > 0).all()
    assert ways.mean(0) == pytest.approx([0, 0, 1 / 2], abs=1 / count)
    assert ways.T @ ways / count == pytest.approx(np.eye(3) / 3, abs=2 / count)
    assert farthest(np.concatenate([ways, -ways]), 2 * count) < EVEN
