"""Poses sampled one by one: range, place in the image, and attitude."""

from dataclasses import dataclass

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.sampling.distribution import Distribution

MAX_TRIES = 10_000  # of a place and an attitude in the picture


@dataclass(frozen=True, kw_only=True)
class PositionLaw:
    """The distribution of the body's origin: `range` metres from the camera, `across` and `down` pixels from the
    principal point, as a lens without distortion would show it.

    frame: width and height of the pictures whose pixels these are; in others they are the same share of the frame.
    """

    range: Distribution
    across: Distribution
    down: Distribution
    frame: tuple[int, int]

    def sample(self, rng: np.random.Generator, camera: Camera) -> Float:
        """Sample a position (3,), metres, camera frame."""
        away, u, v = (number(law, rng) for law in (self.range, self.across, self.down))
        wider, taller = camera.width / self.frame[0], camera.height / self.frame[1]
        ray = np.array([u * wider / camera.fx, v * taller / camera.fy, 1.0])
        place: Float = away * ray / np.linalg.norm(ray)
        return place


@dataclass(frozen=True, kw_only=True)
class PoseLaw:
    """The distribution of a pose. `attitude` gives q_cam_body. whole: all of the body is in the picture."""

    place: PositionLaw
    attitude: Distribution
    whole: bool = False

    def sample(self, rng: np.random.Generator, camera: Camera, hull: Float) -> tuple[Float, Float]:
        """q_cam_body (4,) and t_cam_body (3,), metres, of a body whose hull has the corners `hull` (N, 3), body frame.

        Raises InputError when none of MAX_TRIES poses has all of it in the picture.
        """
        for _ in range(MAX_TRIES):
            q, t = quaternion(self.attitude, rng), self.place.sample(rng, camera)
            if not self.whole or in_frame(camera, hull, q[None], t[None]):
                return q, t
        raise InputError(
            f"none of {MAX_TRIES} poses has all of the target in the picture",
            do="put it farther away or nearer to the middle, or leave out 'whole'",
        )


def in_frame(camera: Camera, hull: Float, q_cam_body: Float, t_cam_body: Float) -> bool:
    """Return whether the corners (N, 3), body frame, lie in the picture at all of the poses (M, 4), (M, 3)."""
    rotations = np.array([matrix_from_quaternion(q) for q in q_cam_body])
    uv = camera.project(np.einsum("mij,nj->mni", rotations, hull) + t_cam_body[:, None])
    return bool(((uv >= 0) & (uv <= (camera.width, camera.height))).all())  # NaN is not


def quaternion(law: Distribution, rng: np.random.Generator) -> Float:
    """Return a sampled quaternion (4,), normalised."""
    q = np.array(law.sample(rng), np.float64)
    if q.shape != (4,) or not np.linalg.norm(q) > 0:
        raise InputError(
            f"attitude {q.tolist()} is not a quaternion", do="sample 'attitudes', or fix four numbers w, x, y, z"
        )
    unit: Float = q / np.linalg.norm(q)
    return unit


def number(law: Distribution, rng: np.random.Generator) -> float:
    """One sampled number."""
    value = law.sample(rng)
    if not isinstance(value, float | int):
        raise InputError(f"{value!r} is not a number", do="sample from a distribution of numbers")
    return float(value)
