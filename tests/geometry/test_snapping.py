"""Snapping: a picked point goes to the nearest of what it snaps to, and a ray is met exactly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spin_usd.geometry.facet import Facet
from spin_usd.geometry.snapping import Snap, met_at, snap_places

EXACT = 1e-9  # metres, on rays of tens of metres
SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])
NUMBERS = st.floats(0.001, 0.999)


@given(NUMBERS, NUMBERS)
def test_each_way_gives_the_nearest_of_its_kind(u, v) -> None:
    met = np.array([2 * u, v, 0])
    places = snap_places(met, Facet.around(SQUARE, FACES, 0))
    assert (places[Snap.SURFACE] == met).all()
    assert places[Snap.VERTEX] == pytest.approx([2 * round(u), round(v), 0])
    assert places[Snap.FACE] == pytest.approx([1, 0.5, 0])
    middles = np.array([[1, 0, 0], [2, 0.5, 0], [1, 1, 0], [0, 0.5, 0]])
    nearest = np.linalg.norm(middles - met, axis=1).min()
    assert np.linalg.norm(places[Snap.EDGE] - met) == pytest.approx(nearest)


@given(NUMBERS, NUMBERS, st.floats(0.1, 50))
def test_a_ray_meets_the_plane_where_it_was_aimed(u, v, height) -> None:
    aim, eye = np.array([2 * u, v, 0]), np.array([-3.0, 5.0, height])
    direction = (aim - eye) / np.linalg.norm(aim - eye)
    distances = met_at(eye, np.stack([direction, direction]), SQUARE[FACES])
    assert eye + distances[:, None] * direction == pytest.approx(np.stack([aim, aim]), abs=EXACT)
