"""Bodies without torques turn as Euler's equations say, which an integrator of SciPy's solves."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from spin_usd.sampling.turning import torque_free, tumbled

INTEGRATOR = 1e-8  # radians: what solve_ivp leaves at rtol 1e-11
DRIFT = 1e-9  # relative, over a thousand radians
RATE = np.array([0.03, -0.02, 0.05])
BODY = np.array([[12.0, 1.0, -0.5], [1.0, 20.0, 2.0], [-0.5, 2.0, 26.0]])


def euler(inertia):
    def change(_, y):
        w, q = y[:3], y[3:]  # q scalar last
        x, y_, z, s = q
        own = [s * w[0] + y_ * w[2] - z * w[1], s * w[1] + z * w[0] - x * w[2], s * w[2] + x * w[1] - y_ * w[0]]
        return [*np.linalg.solve(inertia, -np.cross(w, inertia @ w)), *np.divide([*own, -(q[:3] @ w)], 2)]

    return change


def solved(inertia, times):
    """Rates (N, 3) and attitudes, by SciPy's integrator of Euler's equations."""
    start = [*RATE, 0, 0, 0, 1]
    found = solve_ivp(euler(inertia), (0, times[-1]), start, t_eval=times, rtol=1e-11, atol=1e-13).y.T
    return found[:, :3], Rotation.from_quat(found[:, 3:])


@pytest.mark.parametrize("inertia", [0.6, 1.0, 1.7])
def test_a_body_of_revolution_obeys_eulers_equations(inertia) -> None:
    times = np.linspace(0, 60, 5)
    made = Rotation.from_matrix(torque_free(RATE, (0, 0, 1), inertia, times))
    assert (made.inv() * solved(np.diag([1, 1, inertia]), times)[1]).magnitude().max() < INTEGRATOR


@pytest.mark.parametrize("inertia", [BODY, np.diag([12.0, 20.0, 26.0]), np.diag([3.0, 3.0, 5.0])])
def test_any_body_obeys_eulers_equations(inertia) -> None:
    times = np.linspace(0, 300, 7)
    made = Rotation.from_quat(tumbled(RATE, inertia, times), scalar_first=True)
    assert (made.inv() * solved(inertia, times)[1]).magnitude().max() < INTEGRATOR


def test_both_agree_on_a_body_of_revolution() -> None:
    times = np.linspace(0, 600, 50)
    closed = Rotation.from_matrix(torque_free(RATE, (0, 0, 1), 1.7, times))
    made = Rotation.from_quat(tumbled(RATE, np.diag([1, 1, 1.7]), times), scalar_first=True)
    assert (made.inv() * closed).magnitude().max() < INTEGRATOR


def test_momentum_and_energy_stay_over_a_thousand_radians() -> None:
    """The rate is what the attitude says: its derivative, by differences of eighth order."""
    step, speed = 0.02, float(np.linalg.norm(RATE))
    around = step * np.arange(-4, 5)
    weights = np.array([3, -32, 168, -672, 0, 672, -168, 32, -3]) / 840 / step
    middles = np.array([0.0, 250.0, 500.0, 1000.0]) + 1.0
    times = (middles[:, None] + around).ravel()
    q = tumbled(RATE / speed, BODY, times).reshape(4, 9, 4)
    momenta, energies = [], []
    for each in q:
        own, change = each[4], weights @ each
        w, v = own[0], own[1:]
        rate = 2 * (w * change[1:] - change[0] * v - np.cross(v, change[1:]))
        momenta.append(Rotation.from_quat(own, scalar_first=True).apply(BODY @ rate))
        energies.append(rate @ BODY @ rate / 2)
    start = RATE / speed
    assert np.abs(np.array(momenta) - BODY @ start).max() < DRIFT * np.linalg.norm(BODY @ start)
    assert energies == pytest.approx([start @ BODY @ start / 2] * 4, rel=DRIFT)


def test_a_body_turns_steadily_about_a_principal_axis() -> None:
    times = np.array([0.0, 10.0, 20.0])
    q = tumbled(np.array([0, 0.1, 0]), np.diag([12.0, 20.0, 26.0]), times)
    assert Rotation.from_quat(q, scalar_first=True).as_rotvec() == pytest.approx(np.outer(times, [0, 0.1, 0]))


def test_a_body_at_rest_stays() -> None:
    assert tumbled(np.zeros(3), BODY, np.array([0.0, 5.0])).tolist() == [[1, 0, 0, 0]] * 2
