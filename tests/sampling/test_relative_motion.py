"""Relative motion obeys the equations of Hill, as an integrator of SciPy's does, and its orbits are the known ones."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spin_usd.sampling.relative_motion import RelativeOrbit, between, free_fall, transition

N = 2 * math.pi / 5900
ORBIT = 2 * math.pi / N
INTEGRATOR = 1e-8  # metres: what solve_ivp leaves at rtol 1e-11
CLOSED = 1e-12  # relative: a few roundings


def hill(_, s):
    return [*s[3:], 3 * N**2 * s[0] + 2 * N * s[4], -2 * N * s[3], -(N**2) * s[2]]


def test_free_fall_solves_hills_equations() -> None:
    start = np.array([0.3, 8, -0.2, 1e-3, -2e-3, 5e-4])
    times = np.linspace(0, 12000, 7)
    want = solve_ivp(hill, (0, 12000), start, t_eval=times, rtol=1e-11, atol=1e-13).y.T
    assert np.abs(free_fall(start, N, times) - want).max() < INTEGRATOR


def test_without_an_orbit_motion_is_straight() -> None:
    start = np.array([1.0, 2, 3, 0.1, 0.2, 0.3])
    assert np.allclose(free_fall(start, 0, [10])[0, :3], [2, 4, 6])
    assert np.allclose(transition(1e-9, 10), transition(0, 10), atol=1e-7)


def test_a_transfer_arrives() -> None:
    start, end = np.array([0.1, 8, 0.2]), np.array([-0.3, 3, 0.1])
    state = between(start, end, N, 600)
    assert np.allclose(free_fall(state, N, [0, 600])[:, :3], [start, end])


def test_an_orbit_without_an_offset_upwards_closes() -> None:
    state = RelativeOrbit(forward=7.6, eccentric=0.05, phase_deg=23, inclined=0.04, inclined_phase_deg=57).state(N)
    assert np.allclose(free_fall(state, N, [ORBIT])[0], state, rtol=0, atol=CLOSED * 7.6)


def test_a_fly_around_is_the_known_ellipse() -> None:
    """Twice as long along the flight as it is high, about its middle."""
    orbit = RelativeOrbit(forward=3.0, eccentric=8.0, phase_deg=17, inclined=4.0)
    up, forward, across = orbit.places(N, np.linspace(0, 3 * ORBIT, 400)).T
    assert (up / 8) ** 2 + ((forward - 3) / 16) ** 2 == pytest.approx(np.ones(400), rel=CLOSED, abs=0)
    assert np.abs(across).max() == pytest.approx(4, rel=1e-3)


def test_an_offset_upwards_drifts_back_by_three_pi_times_it_in_each_orbit() -> None:
    state = RelativeOrbit(forward=7.6, up=0.1).state(N)
    assert free_fall(state, N, [ORBIT])[0, 1] == pytest.approx(7.6 - 3 * math.pi * 0.1)


def test_a_place_ahead_is_held() -> None:
    places = RelativeOrbit(forward=-10.0).places(N, np.linspace(0, ORBIT, 9))
    assert places == pytest.approx(np.tile([0.0, -10.0, 0.0], (9, 1)), abs=1e-12)
