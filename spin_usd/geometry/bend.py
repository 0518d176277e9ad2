"""A bend: a straight piece, such as a panel, that follows an arc of constant curvature over its length."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

SAGITTA = 1e-4  # of the length, by which an edge may leave the arc
FINEST = 2.0**-9  # of the length: edges are not split below it


@dataclass(frozen=True, kw_only=True, eq=False)
class Bend:
    """A bend about an axis that is square to the length.

    A point at x along the length, and at z from the middle surface, goes to x' = (1 / k - z) sin(k x) and
    z' = 1 / k - (1 / k - z) cos(k x), with k = angle / length: the middle surface z = 0 keeps its lengths. What is
    before the start (x < 0) stays, and what is past the end goes straight on.
    """

    frame: Float
    """(4, 4) from the piece's axes: its start as the origin, x along it, and z towards which it bends."""
    length: float
    angle: float
    """Radians between the directions of the start and the end; negative to bend towards -z."""

    @property
    def finest(self) -> float:
        """The longest stretch along x that may stay straight."""
        return self.length * max(math.sqrt(8 * SAGITTA / max(abs(self.angle), SAGITTA)), FINEST)

    def too_long(self, a: Float, b: Float) -> NDArray[np.bool_]:
        """Return (E,) which edges, from `a` (E, 3) to `b` (E, 3), leave the arc by more than SAGITTA."""
        along = self.frame[:3, 0]
        x = [np.clip((end - self.frame[:3, 3]) @ along, 0, self.length) for end in (a, b)]
        return np.abs(x[1] - x[0]) > self.finest

    def points(self, points: Float) -> Float:
        """Bend points (N, 3)."""
        x, y, z = self._local(points - self.frame[:3, 3])
        turned, beyond = self._turned(x), x - np.clip(x, 0, self.length)
        half = np.clip(x, 0, self.length) * np.sinc(turned / (2 * np.pi))  # of the chord to the arc's point
        sine, cosine = np.sin(turned), np.cos(turned)
        bent = (half * np.cos(turned / 2) - z * sine + beyond * cosine, y)
        return self._body(*bent, half * np.sin(turned / 2) + z * cosine + beyond * sine) + self.frame[:3, 3]

    def normals(self, points: Float, normals: Float) -> Float:
        """Bend unit normals (N, 3) at `points` (N, 3), which are not bent yet."""
        x, _, z = self._local(points - self.frame[:3, 3])
        turned, within = self._turned(x), (x > 0) & (x < self.length)
        along, y, across = self._local(normals)
        along = along / np.where(within, 1 - z * (self.angle / self.length), 1)
        sine, cosine = np.sin(turned), np.cos(turned)
        bent = self._body(along * cosine - across * sine, y, along * sine + across * cosine)
        return bent / np.linalg.norm(bent, axis=-1, keepdims=True)

    def _turned(self, x: Float) -> Float:
        """Return the angle by which the piece is turned at `x`."""
        return np.clip(x, 0, self.length) * (self.angle / self.length)

    def _local(self, vectors: Float) -> tuple[Float, Float, Float]:
        x, y, z = (vectors @ self.frame[:3, i] for i in range(3))
        return x, y, z

    def _body(self, x: Float, y: Float, z: Float) -> Float:
        vectors: Float = np.stack([x, y, z], axis=-1) @ self.frame[:3, :3].T
        return vectors
