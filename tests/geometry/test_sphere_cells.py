"""Cells of equal area: each has its share of uniform directions, and its bounds and its middle are its own."""

import numpy as np
import pytest

from spin_usd.geometry.sphere_cells import SphereCells

COUNTS = (1, 2, 3, 4, 5, 6, 12, 48, 500)
DIRECTIONS = 200_000
SIGMAS = 5.0  # of a binomial count


def uniform(count, seed=0):
    found = np.random.default_rng(seed).normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("count", COUNTS)
def test_each_cell_has_its_share_of_directions(count) -> None:
    cells = SphereCells(count=count)
    assert sum(cells.rings) == count
    found = np.bincount(cells.places(uniform(DIRECTIONS)), minlength=count)
    wanted = DIRECTIONS / count
    assert len(found) == count
    assert np.abs(found - wanted).max() <= SIGMAS * max(wanted * (1 - 1 / count), 0) ** 0.5


@pytest.mark.parametrize("count", COUNTS)
def test_the_bounds_of_a_cell_hold_its_area_and_its_directions(count) -> None:
    cells, directions = SphereCells(count=count), uniform(2000)
    latitude = np.degrees(np.arcsin(directions[:, 2]))
    longitude = np.degrees(np.arctan2(directions[:, 1], directions[:, 0])) % 360
    places = cells.places(directions)
    for cell in range(count):
        (south, north), (west, east) = cells.bounds(cell)
        area = (np.sin(np.radians(north)) - np.sin(np.radians(south))) * np.radians(east - west)
        assert area == pytest.approx(4 * np.pi / count, rel=1e-9)
        inside = (south <= latitude) & (latitude < north) & (west <= longitude) & (longitude < east)
        assert (inside == (places == cell)).all()


@pytest.mark.parametrize("count", COUNTS)
def test_directions_near_the_middle_are_of_the_cell(count) -> None:
    cells, rng = SphereCells(count=count), np.random.default_rng(1)
    for cell in range(count):
        middle, within = cells.inside(cell)
        assert within > 0
        across = np.linalg.svd(middle[None])[2][1:]
        turn, angle = rng.uniform(0, 2 * np.pi, 50), np.radians(0.999 * within)
        beside = np.cos(turn)[:, None] * across[0] + np.sin(turn)[:, None] * across[1]
        ring = np.cos(angle) * middle + np.sin(angle) * beside
        assert (cells.places(np.vstack([ring, middle])) == cell).all()
