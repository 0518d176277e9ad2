"""Symmetries of the body's axes: each undoes itself, and keeps what it is about."""

import numpy as np
import pytest

from spin_usd.geometry.frames import SYMMETRIES, symmetric

POINTS = np.random.default_rng(5).normal(size=(20, 3))


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_twice_is_as_before(symmetry) -> None:
    assert (symmetric(symmetric(POINTS, symmetry), symmetry) == POINTS).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_plane_stays_and_an_axis_stays(axis) -> None:
    name = "xyz"[axis]
    mirror = next(each for each in SYMMETRIES if each.startswith(f"mirror {name}"))
    in_plane, on_axis = POINTS * (np.arange(3) != axis), POINTS * (np.arange(3) == axis)
    assert (symmetric(in_plane, mirror) == in_plane).all()
    assert (symmetric(on_axis, mirror) == -on_axis).all()
    assert (symmetric(on_axis, f"half turn about {name}") == on_axis).all()
    assert (symmetric(in_plane, f"half turn about {name}") == -in_plane).all()
