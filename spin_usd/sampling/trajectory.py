"""Sequences: a body in free fall near the camera, turning as a body does that nothing turns.

The camera's craft is on a circular orbit and looks along its flight: its x is against the orbit's normal, its y
towards the Earth, its z forward, but for a fixed `tilt`. Relative motion is Clohessy and Wiltshire's ("Terminal
guidance system for satellite rendezvous", 1960) and exact for the linear equations; in a laboratory the period is
infinite and motion straight. Turning is relative to these axes.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from spin_usd.sampling.distribution import Distribution
from spin_usd.sampling.poses import PositionLaw, in_frame, number, quaternion

# Rows: the camera's x, y, z before its tilt, in the orbit's axes (up, forward, normal).
CAM_FROM_ORBIT = np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])
MAX_SEQUENCES = 1000  # tried for one that stays in range and in the picture


@dataclass(frozen=True, kw_only=True)
class RelativeOrbit:
    """The elements of a relative orbit, metres and radians: at the time 0 the mean place is `forward` ahead and `up`
    above, which makes it drift; the ellipse of the eccentricities has the semi-axes `eccentric` (up) and twice that
    (forward), the oscillation across the orbit `inclined`; `phase` and `inclined_phase` are theirs at that time."""

    forward: float
    up: float = 0.0
    eccentric: float = 0.0
    phase: float = 0.0
    inclined: float = 0.0
    inclined_phase: float = 0.0

    def state(self, mean_motion: float) -> Float:
        """Position and velocity (6,) at the time 0, orbit's axes."""
        n, e, i = mean_motion, self.eccentric, self.inclined
        cosine, sine = math.cos(self.phase), math.sin(self.phase)
        place = [self.up + e * cosine, self.forward - 2 * e * sine, i * math.cos(self.inclined_phase)]
        velocity = [-n * e * sine, -1.5 * n * self.up - 2 * n * e * cosine, -n * i * math.sin(self.inclined_phase)]
        return np.array([*place, *velocity])


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """Free fall from a sampled place to another, which it reaches with the sequence's last picture."""

    start: PositionLaw
    end: PositionLaw


@dataclass(frozen=True, kw_only=True)
class Spin:
    """Torque-free rotation of a body of revolution: `degrees` a picture about `axis` (body frame) at the start, with
    `symmetry` its axis and `inertia` the moment about that over the moment across. With 1 it turns steadily."""

    degrees: Distribution
    axis: Distribution
    symmetry: tuple[float, float, float] = (0.0, 0.0, 1.0)
    inertia: float = 1.0

    def turns(self, rng: np.random.Generator, pictures: int) -> Float:
        """R_start_body (pictures, 3, 3)."""
        axis = np.array(self.axis.sample(rng), np.float64)
        rate = math.radians(number(self.degrees, rng))
        return torque_free(rate * axis / np.linalg.norm(axis), self.symmetry, self.inertia, np.arange(pictures))


@dataclass(frozen=True, kw_only=True)
class TrajectoryLaw:
    """`step` seconds between pictures · `period` of the orbit, seconds · tilt: the camera's turn about its x and y,
    radians · centre_of_mass: about which it turns, body frame, metres · range: metres, which it never leaves."""

    path: RelativeOrbit | Transfer
    spin: Spin
    attitude: Distribution
    step: float
    period: float = math.inf
    tilt: tuple[float, float] = (0.0, 0.0)
    centre_of_mass: tuple[float, float, float] = (0.0, 0.0, 0.0)
    range: tuple[float, float] = (0.0, math.inf)
    whole: bool = False

    def sample(self, rng: np.random.Generator, camera: Camera, hull: Float, pictures: int) -> tuple[Float, Float]:
        """q_cam_body (pictures, 4) and t_cam_body (pictures, 3), metres. `hull`: corners (N, 3), body frame.

        Raises InputError when none of MAX_SEQUENCES stays in range and, with `whole`, in the picture.
        """
        for _ in range(MAX_SEQUENCES):
            q, t = self._sequence(rng, camera, pictures)
            away = np.linalg.norm(t, axis=1)
            near = self.range[0] <= away.min() and away.max() <= self.range[1]
            if near and (not self.whole or in_frame(camera, hull, q, t)):
                return q, t
        raise InputError(
            f"none of {MAX_SEQUENCES} sequences keeps the target in range and in the picture",
            do="widen the range, or bring start and end nearer to the middle of the picture",
        )

    def _sequence(self, rng: np.random.Generator, camera: Camera, pictures: int) -> tuple[Float, Float]:
        start = matrix_from_quaternion(quaternion(self.attitude, rng))
        rotations = start @ self.spin.turns(rng, pictures)
        times = self.step * np.arange(pictures, dtype=np.float64)
        mass = self._path(rng, camera, times)
        origin = mass - rotations @ np.array(self.centre_of_mass)
        return np.array([quaternion_from_matrix(r) for r in rotations]), origin

    def _path(self, rng: np.random.Generator, camera: Camera, times: Float) -> Float:
        """Return the centre of mass (N, 3), camera frame."""
        to_cam, n = tilted(self.tilt) @ CAM_FROM_ORBIT, 2 * math.pi / self.period
        if isinstance(self.path, RelativeOrbit):
            state = self.path.state(n)
        else:
            first, last = (to_cam.T @ place.sample(rng, camera) for place in (self.path.start, self.path.end))
            state = between(first, last, n, float(times[-1]))
        path: Float = free_fall(state, n, times)[:, :3] @ to_cam.T
        return path


def free_fall(state: Float, mean_motion: float, times: ArrayLike) -> Float:
    """States (N, 6), position and velocity in the orbit's axes (up, forward, normal), at the times (N), seconds, of a
    body that has `state` (6,) at the time 0."""
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


def torque_free(rate: Float, symmetry: ArrayLike, inertia: float, times: ArrayLike) -> Float:
    """R_start_body (N, 3, 3) at the times (N) of a body of revolution whose angular velocity at the time 0 is `rate`
    (3,), body frame: it turns about its axis while that precesses about the angular momentum, both steadily.

    Source: H. Goldstein, "Classical Mechanics", chapter 5 (the force-free symmetric top).
    """
    axis = np.asarray(symmetry, np.float64) / np.linalg.norm(symmetry)
    about = float(rate @ axis)
    momentum = rate + (inertia - 1) * about * axis  # over the moment across
    return np.array([_turn(momentum * time) @ _turn((1 - inertia) * about * axis * time) for time in np.asarray(times)])


def tilted(angles: tuple[float, float]) -> Float:
    """Return the rotation (3, 3) to the axes of a camera turned by these angles, radians, about its x and its y."""
    return (_turn(np.array([angles[0], 0, 0])) @ _turn(np.array([0, angles[1], 0]))).T


def _turn(vector: Float) -> Float:
    """Return the rotation (3, 3) about `vector` (3,) by its length, radians."""
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle else np.zeros(3)
    return matrix_from_quaternion([math.cos(angle / 2), *(math.sin(angle / 2) * axis)])
