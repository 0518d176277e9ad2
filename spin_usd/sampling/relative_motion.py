"""Motion near a body on a circular orbit, in its axes: x up, y forward, z along the orbit's normal (Hill's axes).

Relative motion is Clohessy and Wiltshire's ("Terminal guidance system for satellite rendezvous", 1960), and exact for
the linear equations; with an infinite period it is straight.
"""

import math
from typing import Annotated, Protocol

import numpy as np
from msgspec import Meta, Struct, field
from numpy.typing import ArrayLike

from spin_usd.basics.arrays import Float
from spin_usd.sampling.distribution import Vector


class RelativeMotion(Protocol):
    """A craft's motion in the orbit's axes."""

    def places(self, mean_motion: float, times: Float) -> Float:
        """Return the places (N, 3), metres, at the times (N), seconds; `mean_motion` in radians a second."""
        ...


class RelativeOrbit(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Elements of a relative orbit, metres and degrees, at the time 0."""

    forward: Annotated[float, Meta(description="Mean place ahead at the start.")] = field(name="forward_m")
    up: Annotated[float, Meta(description="Mean place above, which makes it drift.")] = field(name="up_m", default=0.0)
    eccentric: Annotated[float, Meta(description="Semi-axis upwards of the ellipse; forward it is twice that.")] = (
        field(name="eccentric_m", default=0.0)
    )
    phase_deg: Annotated[float, Meta(description="The ellipse's phase at the start.")] = 0.0
    inclined: Annotated[float, Meta(description="Amplitude across the orbit.")] = field(name="inclined_m", default=0.0)
    inclined_phase_deg: Annotated[float, Meta(description="The phase across the orbit at the start.")] = 0.0

    def state(self, mean_motion: float) -> Float:
        """Position and velocity (6,) at the time 0, orbit's axes."""
        n, e, i = mean_motion, self.eccentric, self.inclined
        phase, inclined_phase = math.radians(self.phase_deg), math.radians(self.inclined_phase_deg)
        cosine, sine = math.cos(phase), math.sin(phase)
        place = [self.up + e * cosine, self.forward - 2 * e * sine, i * math.cos(inclined_phase)]
        velocity = [-n * e * sine, -1.5 * n * self.up - 2 * n * e * cosine, -n * i * math.sin(inclined_phase)]
        return np.array([*place, *velocity])

    def places(self, mean_motion: float, times: Float) -> Float:
        return free_fall(self.state(mean_motion), mean_motion, times)[:, :3]


class FreeFall(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Free fall from a state, orbit's axes."""

    place: Annotated[Vector, Meta(description="At the start.")] = field(name="place_m")
    velocity: Annotated[Vector, Meta(description="At the start.")] = field(name="velocity_m_s")

    def places(self, mean_motion: float, times: Float) -> Float:
        return free_fall(np.array([*self.place, *self.velocity]), mean_motion, times)[:, :3]


class Approach(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Straight and steady, by thrust, orbit's axes: along up an R-bar approach, along forward a V-bar approach."""

    start: Annotated[Vector, Meta(description="In the first picture.")] = field(name="start_m")
    end: Annotated[Vector, Meta(description="In the last picture.")] = field(name="end_m")

    def places(self, mean_motion: float, times: Float) -> Float:
        start, end = np.array(self.start), np.array(self.end)
        share = times[:, None] / max(float(times[-1]), np.finfo(float).tiny)
        return np.asarray(start + share * (end - start))


def free_fall(state: Float, mean_motion: float, times: ArrayLike) -> Float:
    """States (N, 6), position and velocity, at the times (N), seconds, of a body that has `state` (6,) at the time
    0."""
    return np.array([transition(mean_motion, time) @ state for time in np.asarray(times, np.float64)])


def transition(mean_motion: float, time: float) -> Float:
    """Return the matrix (6, 6) that takes a state by Clohessy and Wiltshire's equations through `time` seconds."""
    n, a = mean_motion, mean_motion * time
    if n == 0:
        return np.eye(6) + time * np.eye(6, k=3)
    s, c = math.sin(a), math.cos(a)
    return np.array(
        [
            [4 - 3 * c, 0, 0, s / n, 2 * (1 - c) / n, 0],
            [6 * (s - a), 1, 0, 2 * (c - 1) / n, (4 * s - 3 * a) / n, 0],
            [0, 0, c, 0, 0, s / n],
            [3 * n * s, 0, 0, c, 2 * s, 0],
            [6 * n * (c - 1), 0, 0, -2 * s, 4 * c - 3, 0],
            [0, 0, -n * s, 0, 0, c],
        ]
    )


def between(start: Float, end: Float, mean_motion: float, time: float) -> Float:
    """Return the state (6,) at `start` (3,) that falls to `end` (3,) in `time` seconds, which are fewer than half an
    orbit."""
    if time == 0:
        return np.concatenate([start, np.zeros(3)])
    matrix = transition(mean_motion, time)
    velocity = np.linalg.solve(matrix[:3, 3:], end - matrix[:3, :3] @ start)
    return np.concatenate([start, velocity])
