"""Orbits about the Earth under its central attraction and its flattening (J2), from a state or from elements.

Source: D. Vallado, "Fundamentals of Astrodynamics and Applications"; constants of EGM2008.
"""

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError

GM = 3.986004415e14  # m3/s2
RADIUS, J2 = 6378136.3, 1.0826355e-3  # metres, to which J2 belongs
RELATIVE = 1e-13  # tolerance of a step of the integrator
LONGEST_STEP = 1 / 60  # of the period of an orbit just above the ground; interpolation is then exact to 1e-12
GROUND_PERIOD = 2 * np.pi * np.sqrt(RADIUS**3 / GM)
KEPLER_STEPS, STEEP, FLAT = 100, 0.8, 1e-6  # eccentricities above which Newton's method has to begin at the apogee


def acceleration(place: Float, pole: Float, j2: float = J2) -> Float:
    """Return the acceleration (..., 3), m/s2, at places (..., 3), metres; `pole` (3,): the Earth's."""
    far = np.linalg.norm(place, axis=-1, keepdims=True)
    along = (place @ pole)[..., None] / far
    bulge = 1.5 * j2 * (RADIUS / far) ** 2
    return np.asarray(-GM / far**3 * (place * (1 + bulge * (1 - 5 * along**2)) + 2 * bulge * far * along * pole))


def propagated(state: Float, seconds: Float, pole: Float, j2: float = J2) -> Float:
    """Return the states (N, 6) at `seconds` (N,) before or after a `state` (6,); `j2` 0 makes the Earth a sphere.
    Raises InputError if the orbit meets the ground."""
    from scipy.integrate import solve_ivp  # not above: scipy is slow to load, and few need it

    def change(_: float, now: Float) -> Float:
        return np.concatenate([now[3:], acceleration(now[:3], pole, j2)])

    found = np.empty((len(seconds), 6))
    for sign in (1, -1):
        chosen = seconds * sign >= 0 if sign > 0 else seconds < 0
        if not chosen.any():
            continue
        last = float(seconds[chosen][np.argmax(np.abs(seconds[chosen]))])
        path = solve_ivp(
            change,
            (0.0, last or 1.0),
            state,
            method="DOP853",
            rtol=RELATIVE,
            atol=RELATIVE * RADIUS,
            max_step=GROUND_PERIOD * LONGEST_STEP,
            dense_output=True,
        )
        if np.linalg.norm(path.y[:3], axis=0).min() < RADIUS:
            raise InputError("meets the ground", do="check the elements, or the state")
        assert path.sol is not None
        found[chosen] = path.sol(seconds[chosen]).T
    return found


def state_of(
    semi_major_axis: float, eccentricity: float, inclination: float, node: float, perigee: float, mean_anomaly: float
) -> Float:
    """Return the state (6,) of Keplerian elements, metres and radians."""
    mean_anomaly %= 2 * np.pi
    e, anomaly = eccentricity, mean_anomaly if eccentricity < STEEP else np.pi
    for _ in range(KEPLER_STEPS):  # Newton's, of Kepler's equation
        anomaly -= (anomaly - e * np.sin(anomaly) - mean_anomaly) / (1 - e * np.cos(anomaly))
    p, q = turned(inclination, node, perigee)
    root = np.sqrt(1 - e * e)
    place = semi_major_axis * ((np.cos(anomaly) - e) * p + root * np.sin(anomaly) * q)
    speed = np.sqrt(GM / semi_major_axis) / (1 - e * np.cos(anomaly))
    return np.concatenate([place, speed * (root * np.cos(anomaly) * q - np.sin(anomaly) * p)])


def turned(inclination: float, node: float, perigee: float) -> tuple[Float, Float]:
    """Return the unit vectors towards the perigee, and across it in the orbit's plane."""
    (ci, cn, cw), (si, sn, sw) = (f([inclination, node, perigee]) for f in (np.cos, np.sin))
    p = np.array([cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si])
    return p, np.array([-cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si])


def rtn_axes(states: Float) -> Float:
    """Return the rotations (N, 3, 3) to the axes of states (N, 6): from columns radial, transverse, normal."""
    place, velocity = states[:, :3], states[:, 3:]
    radial = place / np.linalg.norm(place, axis=1, keepdims=True)
    normal = np.cross(place, velocity)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([radial, np.cross(normal, radial), normal], -1)


def from_relative_state(state: Float, place: Float, velocity: Float) -> Float:
    """Return the state (6,) of a craft at `place` (3,) with `velocity` (3,) in the rotating RTN axes of another craft's
    `state`."""
    axes = rtn_axes(state[None])[0]
    turning = np.cross(state[:3], state[3:]) / (state[:3] @ state[:3])
    away = axes @ place
    return np.concatenate([state[:3] + away, state[3:] + axes @ velocity + np.cross(turning, away)])


def elements_of(state: Float) -> tuple[float, ...]:
    """Return semi-major axis, inclination, node, eccentricity along and across the node's direction, and mean argument
    of latitude of a `state` (6,), in metres and radians."""
    place, velocity = state[:3], state[3:]
    momentum = np.cross(place, velocity)
    normal = momentum / np.linalg.norm(momentum)
    far = float(np.linalg.norm(place))
    axis = float(1 / (2 / far - velocity @ velocity / GM))
    eccentricity = np.cross(velocity, momentum) / GM - place / far
    to_node = np.array([-normal[1], normal[0], 0.0]) / np.hypot(normal[0], normal[1])
    across = np.cross(normal, to_node)
    ex, ey = float(eccentricity @ to_node), float(eccentricity @ across)
    size, perigee = np.hypot(ex, ey), np.arctan2(ey, ex)
    true = np.arctan2(place @ across, place @ to_node) - perigee
    eccentric = 2 * np.arctan(np.sqrt((1 - size) / (1 + size)) * np.tan(true / 2))
    inclination = float(np.arctan2(np.hypot(normal[0], normal[1]), normal[2]))
    node = float(np.arctan2(to_node[1], to_node[0]))
    return axis, inclination, node, ex, ey, float(eccentric - size * np.sin(eccentric) + perigee)


def from_relative_elements(state: Float, a_of: Float) -> Float:
    """Return the state (6,) of a craft from its quasi-nonsingular elements relative to another's `state`: `a_of` (6,),
    metres, is da, dlambda, dex, dey, dix, diy times the other's semi-major axis.

    Source: S. D'Amico, "Autonomous formation flying in low Earth orbit" (2010).
    """
    axis, inclination, node, ex, ey, latitude = elements_of(state)
    if abs(np.sin(inclination)) < FLAT:
        do = "give relative_state"
        raise InputError("are relative to an equatorial orbit, for which they are undefined", do=do)
    da, longitude, dex, dey, dix, diy = a_of / axis
    own_inclination, own_node = inclination + dix, node + diy / np.sin(inclination)
    own_latitude = latitude + longitude - (own_node - node) * np.cos(inclination)
    if np.hypot(ex + dex, ey + dey) >= 1:
        raise InputError("do not give an ellipse: a_dex_m and a_dey_m are too large", do="check their units")
    size, perigee = float(np.hypot(ex + dex, ey + dey)), float(np.arctan2(ey + dey, ex + dex))
    return state_of(axis * (1 + da), size, own_inclination, own_node, perigee, own_latitude - perigee)
