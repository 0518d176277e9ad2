"""Rigid transforms that know which frames they join."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.basics.arrays import Float, finite, frozen
from spin_usd.errors import FrameError
from spin_usd.geometry.rotation import check_rotation, matrix_from_quaternion, product, quaternion_from_matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class Transform:
    """`p_to = rotation @ p_of + translation`, metres, double precision.

    `T_a_b = Transform(to="a", of="b", ...)`: `T_a_b @ T_b_c` is `T_a_c`; other products raise FrameError.
    """

    to: str
    of: str
    rotation: Float
    translation: Float

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", check_rotation(self.rotation))
        object.__setattr__(self, "translation", finite(self.translation, (3,), "translation"))

    @classmethod
    def from_quaternion(cls, *, to: str, of: str, q: ArrayLike, t: ArrayLike) -> "Transform":
        """Make a transform from a unit quaternion (4,), scalar first, and a translation (3,) in metres."""
        return cls(to=to, of=of, rotation=matrix_from_quaternion(q), translation=np.asarray(t, np.float64))

    @classmethod
    def unchecked(cls, *, to: str, of: str, rotation: Float, translation: Float) -> "Transform":
        """Return a transform whose `rotation` is known to be one, such as a product of checked ones: the check is
        skipped, because every picture takes several."""
        made = object.__new__(cls)
        for name, value in (
            ("to", to),
            ("of", of),
            ("rotation", frozen(rotation)),
            ("translation", frozen(translation)),
        ):
            object.__setattr__(made, name, value)
        return made

    @property
    def quaternion(self) -> Float:
        """(4,) scalar first, scalar part not negative."""
        return quaternion_from_matrix(self.rotation)

    @property
    def matrix(self) -> Float:
        """(4, 4), column-vector convention."""
        m = np.eye(4)
        m[:3, :3], m[:3, 3] = self.rotation, self.translation
        return m

    def inverse(self) -> "Transform":
        r = self.rotation.T
        return Transform.unchecked(to=self.of, of=self.to, rotation=r, translation=-product(r, self.translation))

    def __matmul__(self, other: "Transform") -> "Transform":
        if self.of != other.to:
            raise FrameError(
                f"T_{self.to}_{self.of} @ T_{other.to}_{other.of} does not join: '{self.of}' is not '{other.to}'"
            )
        return Transform.unchecked(
            to=self.to,
            of=other.of,
            rotation=np.ascontiguousarray(product(self.rotation, other.rotation.T).T),
            translation=product(self.rotation, other.translation) + self.translation,
        )

    def points(self, points: ArrayLike) -> Float:
        """Points (..., 3) of frame `of`, in frame `to`, metres."""
        return product(self.rotation, np.asarray(points, np.float64)) + self.translation

    def directions(self, directions: ArrayLike) -> Float:
        """Directions (..., 3) of frame `of`, in frame `to`: rotated, not moved."""
        return product(self.rotation, np.asarray(directions, np.float64))
