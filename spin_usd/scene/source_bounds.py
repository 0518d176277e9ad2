"""A model's bounds from an independent reader, to compare with the written stage."""

from dataclasses import dataclass

import numpy as np

from spin_usd.basics.arrays import Float

ROUNDING = 1e-5  # of the largest coordinate: points and transforms in float32, a hundred times over
LOOSENESS = 6.0
"""Largest ratio of two boxes' diagonals if one is not tight: the box of a rotated box has edges of at most the first
one's diagonal (sqrt 3), the box of a diagonal rod is sqrt 3 longer than the rod, and Loop's scheme shrinks a
tetrahedron, the worst case, to 1 / 3.43 (7 / 24)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceBounds:
    """Boxes (2, 3) of a model as another reader finds them, metres, in body axes."""

    whole: Float
    """Holds everything."""
    polygons: Float | None
    """Holds the model's plain polygons exactly; None where it has none."""
    exact: bool
    """Whether `whole` is tight: there are only plain polygons."""
    error: float = ROUNDING
    """How far the other reader's own box may be off, of the largest coordinate or edge."""

    def agree_with(self, written: Float) -> bool:
        """Return whether `written`, the box (2, 3) of the written stage, metres, can belong to the same model."""
        within = self.error * max(float(np.abs(self.whole).max()), float(np.ptp(self.whole, axis=0).max()))
        if self.polygons is not None and not _holds(written, self.polygons, within):
            return False
        if self.exact:
            return _holds(self.whole, written, within)
        ratio = _diagonal(written) / max(_diagonal(self.whole), np.finfo(float).tiny)
        return 1 / LOOSENESS <= ratio <= LOOSENESS


def _holds(outer: Float, inner: Float, within: float) -> bool:
    return bool((outer[0] <= inner[0] + within).all() and (outer[1] >= inner[1] - within).all())


def _diagonal(box: Float) -> float:
    return float(np.linalg.norm(box[1] - box[0]))
