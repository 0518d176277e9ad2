"""Motion between known states, by laws: it meets the states and their rates, and steady and free motion are as they
are in closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spin_usd.basics.arrays import Float
from spin_usd.geometry.motion import Motion, between, exp, fitted_rates, log

STEP = 2.0
SPIN, NUTATION, TILT = 0.4, 0.15, 0.5  # radians a second, and radians
SMALL_STEP = 1e-5  # seconds, over which a difference is a derivative


def coning(time: float) -> Rotation:
    """A body that spins about an axis which goes round a cone: no rate is steady in either axes."""
    return Rotation.from_euler("ZXZ", [NUTATION * time, TILT, SPIN * time])


def state(time: float) -> Motion:
    ahead, behind = (coning(time + each) for each in (SMALL_STEP, -SMALL_STEP))
    rate = (ahead * behind.inv()).as_rotvec() / (2 * SMALL_STEP)
    place, velocity = flight(time), (flight(time + SMALL_STEP) - flight(time - SMALL_STEP)) / (2 * SMALL_STEP)
    return Motion(rotation=coning(time).as_matrix(), place=place, velocity=velocity, rate=rate)


def flight(time: float) -> Float:
    return np.array([np.cos(0.1 * time), np.sin(0.1 * time), 0.05 * time])


def test_it_meets_both_states_and_their_rates() -> None:
    first, last = state(0), state(STEP)
    for at, known in ((0, first), (STEP, last)):
        rotation, place = between(first, last, STEP, at)
        assert rotation == pytest.approx(known.rotation, abs=1e-12)
        assert place == pytest.approx(known.place, abs=1e-12)
        inwards = SMALL_STEP if at == 0 else -SMALL_STEP
        turned, moved = between(first, last, STEP, at + inwards)
        assert (moved - place) / inwards == pytest.approx(known.velocity, abs=1e-5)
        assert log(turned @ rotation.T) / inwards == pytest.approx(known.rate, abs=1e-5)


@pytest.mark.parametrize(("halvings", "bound"), [(0, 1e-3), (1, 1e-4), (2, 1e-5)])
def test_its_error_falls_with_the_fourth_power_of_the_step(halvings: int, bound: float) -> None:
    step = STEP / 2**halvings
    rotation, place = between(state(0), state(step), step, step / 2)
    assert np.linalg.norm(log(rotation @ coning(step / 2).as_matrix().T)) < bound
    assert np.linalg.norm(place - flight(step / 2)) < bound


@pytest.mark.parametrize("angle", [1e-6, 1.0, 3.0, 4.0, 2 * np.pi, 20.0])
def test_a_steady_turn_is_steady_through_more_than_a_turn(angle: float) -> None:
    """The rates say how often it goes round, which two attitudes do not."""
    axis = np.array([2.0, -1, 2]) / 3
    rate = axis * angle / STEP
    start = coning(1.0).as_matrix()
    ends = [
        Motion(rotation=exp(rate * time) @ start, place=np.zeros(3), velocity=np.zeros(3), rate=rate)
        for time in (0.0, STEP)
    ]
    for share in (0.25, 0.5, 0.9):
        rotation, _ = between(ends[0], ends[1], STEP, share * STEP)
        assert rotation == pytest.approx(exp(rate * share * STEP) @ start, abs=1e-9)
    assert ends[0].after(STEP)[0] == pytest.approx(ends[1].rotation, abs=1e-12)


def test_rates_are_fitted_and_their_error_is_told() -> None:
    times = np.arange(0, 41, 1.0)
    fit = fitted_rates(times, attitudes(times), np.array([*map(flight, times)]))
    assert fit is not None
    known = [state(time) for time in times]
    assert fit.velocities == pytest.approx(np.array([each.velocity for each in known]), abs=1e-3)
    assert fit.rates[3:-3] == pytest.approx(np.array([each.rate for each in known])[3:-3], abs=1e-3)
    middle, after = known[20], known[21]
    rotation, place = between(middle, after, 1.0, 0.5)
    assert np.linalg.norm(place - flight(20.5)) < fit.missed
    assert np.linalg.norm(log(rotation @ coning(20.5).as_matrix().T)) < fit.missed_rad


def attitudes(times: Float) -> Float:
    return np.array([coning(time).as_matrix() for time in times])


def test_poses_that_have_nothing_to_do_with_one_another_have_no_rates() -> None:
    rng = np.random.default_rng(5)
    turns = Rotation.random(20, random_state=5).as_matrix()
    assert fitted_rates(np.arange(20.0), turns, rng.normal(size=(20, 3))) is None


def test_a_body_at_rest_has_rates_of_zero() -> None:
    fit = fitted_rates(np.arange(7.0), np.repeat(coning(1).as_matrix()[None], 7, 0), np.ones((7, 3)))
    assert fit is not None
    assert not np.abs(fit.rates).max() > 1e-12
    assert not np.abs(fit.velocities).max() > 1e-12
