"""Poses sampled one by one: range, attitude, and place in the frame."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from spin_usd.arrays import Float
from spin_usd.errors import InputError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.framing import Framing, framed_shares, framings
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.sampling.distribution import Distribution

PLACES = (1, 4, 16, 64, 256)  # tried at once for one range and attitude, one after another
MAX_POSES = 30  # ranges and attitudes tried for one picture


class PlaceLaw(Protocol):
    """The distribution of the body's origin in the picture."""

    def rays(self, rng: np.random.Generator, camera: Camera, count: int) -> Float:
        """Return sampled directions (count, 3), camera frame, with z = 1; as many as one after another would be."""
        ...


@dataclass(frozen=True, kw_only=True)
class OffsetLaw:
    """The distribution of the origin's offset: `across` and `down` pixels from the principal point, as a lens without
    distortion would show it.

    frame: width and height of the pictures whose pixels these are; in others they are the same share of the frame.
    """

    across: Distribution
    down: Distribution
    frame: tuple[int, int]

    def rays(self, rng: np.random.Generator, camera: Camera, count: int) -> Float:
        u, v = _pairs(self.across, self.down, rng, count)
        wider, taller = camera.width / self.frame[0], camera.height / self.frame[1]
        return np.asarray(np.array([u * wider / camera.fx, v * taller / camera.fy, np.ones(count)]).T)


@dataclass(frozen=True, kw_only=True)
class ShareLaw:
    """The distribution of the origin's pixel: `u` of the frame's width from its left edge, `v` of its height from its
    top, as the lens shows it."""

    u: Distribution
    v: Distribution

    def rays(self, rng: np.random.Generator, camera: Camera, count: int) -> Float:
        u, v = _pairs(self.u, self.v, rng, count)
        return camera.rays(np.stack([u * camera.width, v * camera.height], -1))


@dataclass(frozen=True, kw_only=True)
class PositionLaw:
    """The distribution of the body's origin: `range` metres from the camera, and its place in the picture."""

    range: Distribution
    place: PlaceLaw

    def sample(self, rng: np.random.Generator, camera: Camera) -> Float:
        """Sample a position (3,), metres, camera frame."""
        place: Float = at_range(number(self.range, rng), self.place.rays(rng, camera, 1))[0]
        return place


@dataclass(frozen=True, kw_only=True)
class Inside:
    """At least `least` and at most `most` of the body is in the picture, 1 being all of its outline."""

    least: float
    most: float = 1.0

    def holds(self, camera: Camera, hull: Float, rotations: Float, translations: Float) -> Iterator[bool]:
        """Yield whether that is so at each of the poses T_cam_body (M, 3, 3), (M, 3) of a body whose hull has the
        corners (N, 3), body frame, metres."""
        if self.least == 1:
            yield from framings(camera, hull, rotations, translations) == Framing.WHOLE
        else:
            for share in framed_shares(camera, hull, rotations, translations):
                yield self.least <= share <= self.most


@dataclass(frozen=True, kw_only=True)
class PoseLaw:
    """The distribution of a pose. `attitude` gives q_cam_body. Range and attitude keep their distributions with
    `inside`, which has the place in the picture sampled again."""

    position: PositionLaw
    attitude: Distribution
    inside: Inside | None = None

    def sample(self, rng: np.random.Generator, camera: Camera, hull: Float) -> tuple[Float, Float]:
        """q_cam_body (4,) and t_cam_body (3,), metres, of a body whose hull has the corners `hull` (N, 3), body frame.

        Raises InputError when for none of MAX_POSES ranges and attitudes a place is inside.
        """
        for _ in range(MAX_POSES):
            q, away = quaternion(self.attitude, rng), number(self.position.range, rng)
            rotation = matrix_from_quaternion(q)
            for count in PLACES:
                t = at_range(away, self.position.place.rays(rng, camera, count))
                if self.inside is None:
                    return q, t[0]
                holds = self.inside.holds(camera, hull, np.broadcast_to(rotation, (count, 3, 3)), t)
                if (good := next((i for i, held in enumerate(holds) if held), None)) is not None:
                    return q, t[good]
        raise InputError(
            f"none of {MAX_POSES * sum(PLACES)} poses has as much of the target in the picture as 'inside' asks for",
            do="put it farther away or nearer to the middle, or change 'inside'",
        )


def at_range(away: float, rays: Float) -> Float:
    """Return the points (N, 3) along `rays` (N, 3) that are `away` metres off."""
    places: Float = away * rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return places


def _pairs(first: Distribution, second: Distribution, rng: np.random.Generator, count: int) -> Float:
    """Return sampled numbers (2, count) of both, sampled in turn."""
    return np.array([[number(law, rng) for law in (first, second)] for _ in range(count)]).T


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
