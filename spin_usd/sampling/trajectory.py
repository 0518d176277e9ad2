"""Sequences: a body and a camera that move near one another on an orbit, the body in torque-free rotation.

There are two cameras. One is on a craft that looks along its flight, past which the target falls: its x is against the
orbit's normal, its y towards the Earth, its z forward. The other is on a craft that moves about the target and points
at it: its x is as close as possible to the orbit's normal reversed; behind the target both are the same. A fixed `tilt`
turns either.
"""

import math
from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError, NotFramedError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrices_from_quaternions, matrix_from_quaternion, quaternion_from_matrix
from spin_usd.sampling.distribution import Distribution
from spin_usd.sampling.poses import Inside, PositionLaw, quaternion
from spin_usd.sampling.relative_motion import RelativeMotion, RelativeOrbit, between, free_fall
from spin_usd.sampling.turning import Spin, Tumble, turn

# Rows: the forward-looking camera's x, y, z before its tilt, in the orbit's axes (up, forward, normal).
CAM_FROM_ORBIT = np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])
NORMAL, FORWARD = np.eye(3)[2], np.eye(3)[1]
ALONG_NORMAL = 1e-9  # a sine: a camera that looks along the normal itself takes the flight for its x
MAX_SEQUENCES = 1000  # tried for one that stays in range and in the picture


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """Free fall from a sampled place to another, which it reaches with the sequence's last picture."""

    start: PositionLaw
    end: PositionLaw


@dataclass(frozen=True, kw_only=True)
class Chaser:
    """The camera's craft, whose `motion` is in the axes of the target's orbit; the camera points at the target."""

    motion: RelativeMotion


@dataclass(frozen=True, kw_only=True)
class TrajectoryLaw:
    """How the target and the camera's craft move."""

    path: RelativeOrbit | Transfer | Chaser
    """Path of the target past the camera's craft, or of the craft about the target."""
    spin: Spin | Tumble
    attitude: Distribution
    step: float
    """Seconds between pictures."""
    period: float = math.inf
    """Period of the orbit, seconds."""
    tilt: tuple[float, float] = (0.0, 0.0)
    """The camera's turn about its x and y, radians."""
    centre_of_mass: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The point about which the target turns, body frame, metres."""
    range: tuple[float, float] = (0.0, math.inf)
    """The least and greatest distance, metres, which it never leaves."""
    inside: Inside | None = None
    sun: Distribution | None = None
    """The direction to the Sun, in the orbit's axes at the start; it stays among the stars."""

    @property
    def needs_hull(self) -> bool:
        """Return whether a sample depends on the target's hull, not on its box alone."""
        return self.inside is not None

    def sample(self, rng: np.random.Generator, camera: Camera, hull: Float, pictures: int) -> tuple[Float, Float]:
        """q_cam_body (pictures, 4) and t_cam_body (pictures, 3), metres. `hull`: corners (N, 3), body frame.

        Raises InputError if none of MAX_SEQUENCES stays in range and, as far as `inside` requires, in the picture.
        """
        for _ in range(MAX_SEQUENCES):
            q, t = self._sequence(rng, camera, pictures)
            away = np.linalg.norm(t, axis=1)
            if self.range[0] <= away.min() and away.max() <= self.range[1] and self._is_inside(camera, hull, q, t):
                return q, t
        raise (NotFramedError if self.inside else InputError)(
            f"none of {MAX_SEQUENCES} sequences keeps the target in range and in the picture",
            do="widen the range, or bring start and end nearer to the middle of the picture",
        )

    def sun_directions(self, rng: np.random.Generator, pictures: int) -> Float:
        """Return unit vectors (pictures, 3) to the Sun, camera frame; `sun` is not None."""
        assert self.sun is not None
        towards = np.array(self.sun.sample(rng), np.float64)
        axes = self._cam_from_orbit(pictures) @ self._orbit_from_start(pictures)
        return np.asarray(axes @ (towards / np.linalg.norm(towards)))

    def _is_inside(self, camera: Camera, hull: Float, q: Float, t: Float) -> bool:
        return self.inside is None or all(self.inside.holds(camera, hull, matrices_from_quaternions(q), t))

    def _sequence(self, rng: np.random.Generator, camera: Camera, pictures: int) -> tuple[Float, Float]:
        """Return the poses (pictures, 4), (pictures, 3) of one sampled sequence."""
        start = matrix_from_quaternion(quaternion(self.attitude, rng))
        axes = self._cam_from_orbit(pictures)
        at_start = axes[0].T @ start @ self.spin.turns(rng, self._times(pictures))  # R_orbit_body, or of the stars
        if self.spin.inertial:
            at_start = self._orbit_from_start(pictures) @ at_start
        rotations = axes @ at_start
        origin = self._path(rng, camera, axes) - rotations @ np.array(self.centre_of_mass)
        return np.array([quaternion_from_matrix(r) for r in rotations]), origin

    def _path(self, rng: np.random.Generator, camera: Camera, axes: Float) -> Float:
        """Return the target's centre of mass (N, 3), camera frame; axes: R_cam_orbit (N, 3, 3)."""
        times, n = self._times(len(axes)), self._mean_motion
        if isinstance(self.path, Chaser):
            return np.asarray(-np.einsum("nij,nj->ni", axes, self.path.motion.places(n, times)))
        if isinstance(self.path, RelativeOrbit):
            state = self.path.state(n)
        else:
            first, last = (axes[0].T @ place.sample(rng, camera) for place in (self.path.start, self.path.end))
            state = between(first, last, n, float(times[-1]))
        path: Float = free_fall(state, n, times)[:, :3] @ axes[0].T
        return path

    def _cam_from_orbit(self, pictures: int) -> Float:
        """Return R_cam_orbit (pictures, 3, 3)."""
        if not isinstance(self.path, Chaser):
            return np.stack([tilted(self.tilt) @ CAM_FROM_ORBIT] * pictures)
        places = self.path.motion.places(self._mean_motion, self._times(pictures))
        return np.array([tilted(self.tilt) @ pointing(-place) for place in places])

    def _orbit_from_start(self, pictures: int) -> Float:
        """Return (pictures, 3, 3) from the orbit's axes at the start, inertially fixed, to each picture's."""
        return np.array([turn(-self._mean_motion * time * NORMAL) for time in self._times(pictures)])

    def _times(self, pictures: int) -> Float:
        """Return the seconds (pictures,) of the pictures."""
        return self.step * np.arange(pictures, dtype=np.float64)

    @property
    def _mean_motion(self) -> float:
        return 2 * math.pi / self.period


def pointing(towards: Float) -> Float:
    """Return the rotation (3, 3) from the orbit's axes to a camera's that looks along `towards` (3,), orbit's axes.
    Raises InputError if that has no direction."""
    length = float(np.linalg.norm(towards))
    if not length > 0:
        raise InputError("the camera is at the target's centre of mass", do="keep the chaser away from the target")
    z = towards / length
    x = -NORMAL + (NORMAL @ z) * z
    if np.linalg.norm(x) < ALONG_NORMAL:
        x = FORWARD - (FORWARD @ z) * z
    x = x / np.linalg.norm(x)
    return np.array([x, np.cross(z, x), z])


def tilted(angles: tuple[float, float]) -> Float:
    """Return the rotation (3, 3) to the axes of a camera turned by these angles, radians, about its x and its y."""
    return (turn(np.array([angles[0], 0, 0])) @ turn(np.array([0, angles[1], 0]))).T
