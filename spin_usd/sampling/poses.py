"""Poses sampled one by one: range, attitude, and place in the frame or beside another body; bodies keep apart."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError, NotFramedError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.framing import Framing, framed_shares, framings
from spin_usd.geometry.rotation import matrix_from_quaternion
from spin_usd.sampling.distribution import Distribution

PLACES = (1, 4, 16, 64, 256)  # tried at once for one range and attitude, one after another
MAX_POSES = 30  # ranges and attitudes tried for one picture
GAP = 0.05  # of the radii of two balls: the least gap between them


class PlaceLaw(Protocol):
    """The distribution of the body's origin in the picture."""

    def rays(self, rng: np.random.Generator, camera: Camera, count: int) -> Float:
        """Return sampled directions (count, 3), camera frame, with z = 1; as many as one after another would be."""
        ...


@dataclass(frozen=True, kw_only=True)
class OffsetLaw:
    """The distribution of the origin's offset: `across` and `down` pixels from the principal point, as a lens without
    distortion would show it."""

    across: Distribution
    down: Distribution
    frame: tuple[int, int]
    """Width and height of the pictures whose pixels these are; in others they are the same share of the frame."""

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
    """The distribution of the body's origin: its `range` from the camera, and its place in the picture."""

    range: Distribution
    place: PlaceLaw
    in_diameters: bool = False
    """Whether the range is in diameters of the ball around the body, instead of metres."""

    def away(self, rng: np.random.Generator, hull: Float) -> float:
        """Return a sampled distance, metres, of a body with the corners `hull` (N, 3)."""
        return number(self.range, rng) * (2 * ball_of(hull)[1] if self.in_diameters else 1.0)

    def places(self, rng: np.random.Generator, camera: Camera, away: float, count: int) -> Float:
        """Return sampled positions (count, 3), metres, camera frame, that are `away` metres off."""
        return at_range(away, self.place.rays(rng, camera, count))

    def sample(self, rng: np.random.Generator, camera: Camera) -> Float:
        """Sample a position (3,), metres, camera frame."""
        place: Float = self.places(rng, camera, number(self.range, rng), 1)[0]
        return place


@dataclass(frozen=True, kw_only=True)
class BesideLaw:
    """The distribution of the origin of a body beside another: `range` metres from the other's, which is at `other`,
    metres, camera frame, every direction alike."""

    range: Distribution
    other: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def away(self, rng: np.random.Generator, hull: Float) -> float:
        """Return a sampled distance, metres, whatever the body's `hull`."""
        return number(self.range, rng)

    def places(self, rng: np.random.Generator, camera: Camera, away: float, count: int) -> Float:
        """Return sampled positions (count, 3), like PositionLaw, `away` metres from the other."""
        return np.asarray(self.other + at_range(away, rng.normal(size=(count, 3))))


@dataclass(frozen=True, kw_only=True, eq=False)
class Balls:
    """Balls around obstacles of a body."""

    middles: Float
    """(N, 3), metres, camera frame."""
    radii: Float
    """(N,), metres."""

    def apart(self, hull: Float, rotation: Float, translations: Float) -> NDArray[np.bool_]:
        """Return (M,) whether the ball of the body with the corners `hull` (N, 3), body frame, is GAP and more from all
        of these, at the poses T_cam_body of one `rotation` (3, 3) and the `translations` (M, 3), metres."""
        middle, radius = ball_of(hull)
        between = np.linalg.norm((translations + rotation @ middle)[:, None] - self.middles, axis=-1)
        return np.asarray((between > (1 + GAP) * (self.radii + radius)).all(1))


NOTHING = Balls(middles=np.zeros((0, 3)), radii=np.zeros(0))


def ball_of(hull: Float) -> tuple[Float, float]:
    """Return middle (3,) and radius of a ball around the corners (N, 3): about the middle of their box."""
    middle: Float = (hull.min(0) + hull.max(0)) / 2
    return middle, float(np.linalg.norm(hull - middle, axis=1).max())


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
    `inside` and other bodies, which have the place sampled again."""

    position: PositionLaw | BesideLaw
    attitude: Distribution
    inside: Inside | None = None

    @property
    def needs_hull(self) -> bool:
        """Return whether a sample depends on the body's hull, not on its box alone."""
        return self.inside is not None or (isinstance(self.position, PositionLaw) and self.position.in_diameters)

    def sample(
        self, rng: np.random.Generator, camera: Camera, hull: Float, others: Balls = NOTHING
    ) -> tuple[Float, Float]:
        """q_cam_body (4,) and t_cam_body (3,), metres, of a body whose hull has the corners `hull` (N, 3), body frame,
        and which keeps apart from the `others`.

        Raises InputError when for none of MAX_POSES ranges and attitudes a place is apart and inside.
        """
        for _ in range(MAX_POSES):
            q, away = quaternion(self.attitude, rng), self.position.away(rng, hull)
            rotation = matrix_from_quaternion(q)
            for count in PLACES:
                t = self.position.places(rng, camera, away, count)
                apart = t[others.apart(hull, rotation, t)]
                if len(apart) and (good := self._first_inside(camera, hull, rotation, apart)) is not None:
                    return q, good
        asked = ["keeps apart from the other bodies"] if len(others.radii) else []
        if self.inside is not None:
            across = f"{np.ptp(hull, axis=0).max():.3g} m across"
            asked.append(f"has as much of the target, {across}, in the picture as 'inside' requires")
        do = (
            "give it a larger range or distance" if len(others.radii) else "put it farther away or nearer to the middle"
        )
        found = f"none of {MAX_POSES * sum(PLACES)} poses {' and '.join(asked)}"
        if self.inside:
            raise NotFramedError(found, do=f"{do}, change 'inside', or check the unit of the model")
        raise InputError(found, do=do)

    def _first_inside(self, camera: Camera, hull: Float, rotation: Float, places: Float) -> Float | None:
        """Return the first of the places (M, 3) where the body is inside, as far as required."""
        if self.inside is None:
            first: Float = places[0]
            return first
        holds = self.inside.holds(camera, hull, np.broadcast_to(rotation, (len(places), 3, 3)), places)
        return next((place for place, held in zip(places, holds, strict=True) if held), None)


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
