"""Triangles split at the midpoints of their edges, so that a surface of few triangles can follow a curve.

An edge is split for all of its triangles or for none, and at the same point: a closed surface stays closed.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

Int = NDArray[np.int64]
MAX_ROUNDS = 16
MAX_SPLIT = 2**17  # triangles of one piece: a split that would lead to more is left undone
EDGES = ((0, 1), (1, 2), (2, 0))
PIECES = (
    ((0, 1, 2),),
    ((0, 3, 2), (3, 1, 2)),
    ((1, 4, 0), (4, 2, 0)),
    ((3, 1, 4), (0, 3, 4), (0, 4, 2)),
    ((2, 5, 1), (5, 0, 1)),
    ((5, 0, 3), (2, 5, 3), (2, 3, 1)),
    ((4, 2, 5), (1, 4, 5), (1, 5, 0)),
    ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
)
"""The triangles that one becomes, by the sum of 1, 2 and 4 for its split EDGES: of its corners 0 to 2, and of the
midpoints 3 to 5 of its edges."""
NODES = np.array([*np.eye(3), *((np.eye(3)[i] + np.eye(3)[j]) / 2 for i, j in EDGES)])
"""(6, 3): the shares of a triangle's corners in its corners and midpoints."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Split:
    """A split surface."""

    points: Float
    """(P, 3): the points before, and then the midpoints."""
    corners: Int
    """(T, 3): indices of points, wound as before."""
    of: Int
    """(T,): the number of the triangle before, of which each is a piece."""
    shares: Float
    """(T, 3, 3): the shares of that one's corners in each corner."""

    def values(self, before: Float) -> Float:
        """Interpolate values (T before, 3, C) at corners for the corners of the pieces: (T, 3, C)."""
        values: Float = self.shares @ before[self.of]
        return values


def split_edges(points: Float, corners: Int, too_long: Callable[[Float, Float], NDArray[np.bool_]]) -> Split:
    """Split all edges that are `too_long`, from their ends (E, 3) and (E, 3), again and again: until none is, or the
    surface would have more than MAX_SPLIT triangles."""
    found = Split(
        points=points,
        corners=corners,
        of=np.arange(len(corners)),
        shares=np.broadcast_to(np.eye(3), (len(corners), 3, 3)),
    )
    for _ in range(MAX_ROUNDS):
        ends = np.sort(found.corners[:, EDGES].reshape(-1, 2), axis=1)
        numbers, of_edge = np.unique(ends @ (len(found.points), 1), return_inverse=True)  # rows take ten times as long
        edges = np.stack(np.divmod(numbers, len(found.points)), axis=1)
        chosen = too_long(found.points[edges[:, 0]], found.points[edges[:, 1]])
        marked = chosen[of_edge].reshape(-1, 3)
        if not chosen.any() or len(marked) + int(marked.sum()) > MAX_SPLIT:
            return found
        found = _split_once(found, edges[chosen], (np.cumsum(chosen) - 1)[of_edge].reshape(-1, 3), marked)
    return found


def _split_once(before: Split, edges: Int, midpoint: Int, marked: NDArray[np.bool_]) -> Split:
    """Split the `marked` (T, 3) edges. edges: (M, 2) that are split; midpoint: (T, 3) the number of each one's."""
    nodes = np.concatenate([before.corners, len(before.points) + midpoint], axis=1)
    code = marked @ (1, 2, 4)
    corners, of, shares = [], [], []
    for kind, pieces in enumerate(PIECES):
        those = np.flatnonzero(code == kind)
        for piece in pieces:
            corners.append(nodes[those][:, piece])
            of.append(before.of[those])
            shares.append(NODES[list(piece)] @ before.shares[those])
    ends = before.points[edges]
    return Split(
        points=np.concatenate([before.points, (ends[:, 0] + ends[:, 1]) / 2]),
        corners=np.concatenate(corners),
        of=np.concatenate(of),
        shares=np.concatenate(shares),
    )
