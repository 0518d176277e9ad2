"""Trajectories obey the equations of relative motion and of a free top, as an integrator of SciPy's does."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.sampling.distribution import Attitudes, Directions, Fixed, Normal, Uniform
from spin_usd.sampling.poses import PositionLaw
from spin_usd.sampling.stream import stream
from spin_usd.sampling.trajectory import (
    RelativeOrbit,
    Spin,
    TrajectoryLaw,
    Transfer,
    between,
    free_fall,
    torque_free,
    transition,
)

CAMERA = Camera(width=1440, height=1080, fx=1745, fy=1747, cx=737, cy=528)
N = 2 * math.pi / 5900
INTEGRATOR = 1e-8  # metres, radians: what solve_ivp leaves at rtol 1e-11
HULL = np.array([[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])


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
    state = RelativeOrbit(forward=7.6, eccentric=0.05, phase=0.4, inclined=0.04, inclined_phase=1).state(N)
    assert np.allclose(free_fall(state, N, [2 * math.pi / N])[0], state)


def test_an_offset_upwards_drifts_back_by_three_pi_times_it_in_each_orbit() -> None:
    state = RelativeOrbit(forward=7.6, up=0.1).state(N)
    assert free_fall(state, N, [2 * math.pi / N])[0, 1] == pytest.approx(7.6 - 3 * math.pi * 0.1)


@pytest.mark.parametrize("inertia", [0.6, 1.0, 1.7])
def test_the_top_obeys_eulers_equations(inertia) -> None:
    rate = np.array([0.03, -0.02, 0.05])
    moments = np.array([1, 1, inertia])

    def euler(_, y):
        w, q = y[:3], y[3:]
        turn = Rotation.from_quat(q) * Rotation.from_quat([*(w / 2), 0]) if np.linalg.norm(w) else None
        dq = np.linalg.norm(w) / 2 * turn.as_quat(canonical=False) * np.linalg.norm(q)
        return [*(-np.cross(w, moments * w) / moments), *dq]

    times = np.linspace(0, 60, 5)
    found = solve_ivp(euler, (0, 60), [*rate, 0, 0, 0, 1], t_eval=times, rtol=1e-11, atol=1e-13).y.T
    for made, q in zip(torque_free(rate, (0, 0, 1), inertia, times), found[:, 3:], strict=True):
        assert (Rotation.from_matrix(made).inv() * Rotation.from_quat(q)).magnitude() < INTEGRATOR


AROUND, FRAME = Normal(mean=0, sigma=100), (CAMERA.width, CAMERA.height)


def law(**changes):
    ends = [PositionLaw(range=Uniform(low=1.5, high=10), across=AROUND, down=AROUND, frame=FRAME) for _ in range(2)]
    spin = Spin(degrees=Fixed(value=1.5), axis=Directions())
    fields = {"path": Transfer(start=ends[0], end=ends[1]), "spin": spin, "attitude": Attitudes(), "step": 0.1}
    return TrajectoryLaw(**fields | {"period": 5900.0, "range": (1.5, 10.0), "whole": True} | changes)


def test_pictures_follow_one_another_steadily() -> None:
    q, t = law().sample(stream(1, "a"), CAMERA, HULL, 100)
    turned = Rotation.from_quat(q, scalar_first=True)
    assert np.allclose(np.degrees((turned[:-1].inv() * turned[1:]).magnitude()), 1.5)
    steps = np.diff(t, axis=0)
    assert np.abs(np.diff(steps, axis=0)).max() < 1e-3 * np.abs(steps).max()  # ten seconds bend no path


def test_the_body_turns_about_its_centre_of_mass() -> None:
    mass = np.array([0.0, 0.02, 0.16])
    still = RelativeOrbit(forward=8)
    q, t = law(path=still, centre_of_mass=tuple(mass)).sample(stream(1, "a"), CAMERA, HULL, 50)
    middle = Rotation.from_quat(q, scalar_first=True).apply(mass) + t
    assert np.allclose(middle, [0, 0, 8])
    assert np.ptp(t, axis=0).max() > 0.05


def test_a_tilted_camera_sees_the_target_where_it_was_turned_from() -> None:
    _, t = law(path=RelativeOrbit(forward=8), tilt=(0.01, 0.0)).sample(stream(1, "a"), CAMERA, HULL, 1)
    assert t[0] == pytest.approx([0, 8 * math.sin(0.01), 8 * math.cos(0.01)])  # turned up: what is ahead moves down


def test_what_cannot_stay_in_the_picture_is_said() -> None:
    with pytest.raises(InputError, match="none of 1000 sequences"):
        law(path=RelativeOrbit(forward=8), range=(1, 2)).sample(stream(1, "a"), CAMERA, HULL, 2)
