"""Orbits by laws: Kepler's, what a flattened Earth keeps and turns, and the closed form of relative motion."""

import numpy as np
import pytest

from spin_usd.errors import InputError
from spin_usd.orbits.propagation import (
    GM,
    J2,
    RADIUS,
    acceleration,
    elements_of,
    from_relative_elements,
    from_relative_state,
    propagated,
    rtn_axes,
    state_of,
)
from spin_usd.sampling.relative_motion import transition

POLE = np.array([0.0, 0, 1])
AXIS, INCLINATION = 7.078e6, 1.71
PERIOD = 2 * np.pi * np.sqrt(AXIS**3 / GM)
MICROMETRES = 5e-6
KEPT = 1e-12  # relative, of energy and momentum over an orbit


def circular(phase: float = 0.3):
    return state_of(AXIS, 0.0, INCLINATION, 0.4, 0.0, phase)


def test_a_circular_orbit_is_a_circle_in_time() -> None:
    times = np.linspace(-PERIOD / 2, PERIOD, 301)
    states = propagated(circular(), times, POLE, 0.0)
    known = np.array([circular(0.3 + 2 * np.pi * time / PERIOD) for time in times])
    assert np.abs(states - known)[:, :3].max() < MICROMETRES


@pytest.mark.parametrize("eccentricity", [0.0, 0.001, 0.3, 0.7])
def test_energy_and_momentum_are_kept(eccentricity) -> None:
    start = state_of(2.5e7 if eccentricity > 0.1 else AXIS, eccentricity, INCLINATION, 0.4, 1.0, 0.2)
    states = propagated(start, np.linspace(0, PERIOD, 50), POLE, 0.0)
    far = np.linalg.norm(states[:, :3], axis=1)
    energy = (states[:, 3:] ** 2).sum(1) / 2 - GM / far
    momentum = np.cross(states[:, :3], states[:, 3:])
    assert energy == pytest.approx(energy[0], rel=KEPT)
    assert momentum == pytest.approx(np.broadcast_to(momentum[0], momentum.shape), rel=KEPT, abs=KEPT * 1e11)


def test_a_flattened_earth_keeps_energy_and_the_momentum_about_its_pole() -> None:
    states = propagated(circular(), np.linspace(0, PERIOD, 50), POLE)
    far = np.linalg.norm(states[:, :3], axis=1)
    sine = states[:, 2] / far
    energy = (states[:, 3:] ** 2).sum(1) / 2 - GM / far * (1 - J2 * (RADIUS / far) ** 2 * (1.5 * sine**2 - 0.5))
    about = np.cross(states[:, :3], states[:, 3:])[:, 2]
    assert energy == pytest.approx(energy[0], rel=KEPT)
    assert about == pytest.approx(about[0], rel=KEPT * 10)


def test_the_node_of_a_sun_synchronous_orbit_follows_the_sun() -> None:
    """At 98.19 degrees and 700 km the node turns by 360 degrees a year."""
    start = state_of(AXIS, 0.0, np.radians(98.19), 0.4, 0.0, 0.0)
    days = 2.0
    first, last = (elements_of(state)[2] for state in propagated(start, np.array([0.0, days * 86400]), POLE))
    assert np.degrees(last - first) / days == pytest.approx(360 / 365.2422, rel=0.02)


def test_elements_come_back_from_a_state() -> None:
    axis, inclination, node, ex, ey, latitude = elements_of(state_of(AXIS, 0.01, INCLINATION, 0.4, 1.0, 0.2))
    assert (axis, inclination, node) == pytest.approx((AXIS, INCLINATION, 0.4), rel=1e-9)
    assert (np.hypot(ex, ey), np.arctan2(ey, ex), latitude) == pytest.approx((0.01, 1.0, 1.2), rel=1e-9)


def test_the_acceleration_is_the_gradient_of_the_potential() -> None:
    def potential(place):
        far = np.linalg.norm(place)
        return GM / far * (1 - J2 * (RADIUS / far) ** 2 * (1.5 * (place @ POLE / far) ** 2 - 0.5))

    place, step = np.array([5e6, -3e6, 4e6]), 10.0
    slopes = [(potential(place + step * axis) - potential(place - step * axis)) / (2 * step) for axis in np.eye(3)]
    assert acceleration(place, POLE) == pytest.approx(np.array(slopes), rel=1e-8)


def test_relative_motion_has_the_closed_form_of_hill() -> None:
    """A circular relative orbit of 100 m: what is not linear in it is of the order of its square over the radius."""
    mean_motion = 2 * np.pi / PERIOD
    place = np.array([50.0, 0.0, 50 * np.sqrt(3)])
    velocity = np.array([0.0, -2 * mean_motion * place[0], 0.0])
    times = np.linspace(0, PERIOD, 41)
    target = propagated(circular(), times, POLE, 0.0)
    chaser = propagated(from_relative_state(circular(), place, velocity), times, POLE, 0.0)
    found = np.einsum("nji,nj->ni", rtn_axes(target), chaser[:, :3] - target[:, :3])
    known = np.array([transition(mean_motion, time) @ np.concatenate([place, velocity]) for time in times])[:, :3]
    assert np.abs(found - known).max() < 20 * 100.0**2 / AXIS
    assert np.linalg.norm(known, axis=1) == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("elements", "place"),
    [
        ([0, 100, 0, 0, 0, 0], [0, 100, 0]),
        ([50, 0, 0, 0, 0, 0], [50, 0, 0]),
    ],
)
def test_relative_elements_of_a_circular_orbit_are_where_they_say(elements, place) -> None:
    state = circular()
    other = from_relative_elements(state, np.array(elements, float))
    assert rtn_axes(state[None])[0].T @ (other[:3] - state[:3]) == pytest.approx(np.array(place), abs=2e-3)


def test_safe_relative_elements_make_an_ellipse_across_the_orbit() -> None:
    """Parallel vectors of eccentricity and inclination: radial and normal motion are never both nought."""
    times = np.linspace(0, PERIOD, 60)
    target = propagated(circular(), times, POLE, 0.0)
    chaser = propagated(from_relative_elements(circular(), np.array([0, 0, 0, 80.0, 0, 80.0])), times, POLE, 0.0)
    radial, _, normal = np.einsum("nji,nj->in", rtn_axes(target), chaser[:, :3] - target[:, :3])
    assert np.hypot(radial, normal) == pytest.approx(80.0, rel=1e-3)


def test_what_meets_the_ground_is_refused() -> None:
    with pytest.raises(InputError, match="meets the ground"):
        propagated(state_of(6.6e6, 0.1, 1.0, 0, 0, 3.0), np.array([0, 6000.0]), POLE)
