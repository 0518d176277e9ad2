"""A surface to compare: triangles, or a cloud of points, with its nearest points to others."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.triangles import cross, distances_to, lengths, spread_points, unit_normals

if TYPE_CHECKING:
    from scipy.spatial import KDTree

DENSE = 200_000  # points of a mesh by area, and as many by length, by which its nearest triangles are found
PER_FACE = 1000  # of these for each triangle at most: few triangles need no more
CANDIDATES = 32  # points near to another whose triangles may be the nearest to it
FEW = 8  # triangles that are all tried
COARSE = 64  # of the points of triangles one in so many; for those far away, whose search in all would take very long
FAR = 8.0  # as many times the mean distance between coarse points
AT_ONCE = 1 << 16


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoredSurface:
    """Triangles, or a cloud of points."""

    points: Float
    """(N, 3) a cloud, or points spread evenly by area over the triangles."""
    normals: Float | None
    """(N, 3) unit; None for a cloud without."""
    corners: Float | None = None
    """(F, 3, 3) the triangles; None for a cloud."""

    @classmethod
    def of_triangles(cls, corners: Float, count: int, rng: np.random.Generator) -> "ScoredSurface":
        """Return the triangles (F, 3, 3), some of which have an area, with `count` points."""
        points, face = spread_points(corners, count, rng)
        return cls(points=points, normals=unit_normals(corners[face]), corners=corners)

    def moved(self, scale: float, R: Float, t: Float) -> "ScoredSurface":
        """Return the surface with each point x at scale R x + t; R is (3, 3), t (3,)."""
        normals = None if self.normals is None else self.normals @ R.T
        corners = None if self.corners is None else scale * self.corners @ R.T + t
        return ScoredSurface(points=scale * self.points @ R.T + t, normals=normals, corners=corners)

    def nearest(self, points: Float) -> tuple[Float, Float | None]:
        """Return (M,) the distances of `points` (M, 3) from the surface, and the normals (M, 3) there, if it has any.

        On triangles it is the nearest of those that the nearest of many points lie on: more than the true distance only
        where triangles are smaller than the points are apart, and by less than 1 % far from the surface.
        """
        found = [self._nearest(points[start : start + AT_ONCE]) for start in range(0, len(points), AT_ONCE)]
        apart, normals = np.concatenate([each for each, _ in found]), [each for _, each in found if each is not None]
        return apart, np.concatenate(normals) if normals else None

    def _nearest(self, points: Float) -> tuple[Float, Float | None]:
        if self.corners is None:
            apart, place = (np.asarray(each) for each in self._tree[0].query(points))
            return apart, None if self.normals is None else self.normals[place]
        if len(self.corners) <= FEW:
            candidates = np.broadcast_to(np.arange(len(self.corners)), (len(points), len(self.corners)))
        else:
            candidates = self._candidates(points)
        each = distances_to(points[:, None], self.corners[candidates])
        best = each.argmin(1)
        chosen = candidates[np.arange(len(points)), best]
        return each[np.arange(len(points)), best], unit_normals(self.corners[chosen])

    def _candidates(self, points: Float) -> NDArray[np.intp]:
        """Return for each of the points (M, 3) the triangles (M, CANDIDATES) that its nearest points of the surface lie
        on."""
        assert self.corners is not None
        tree, face = self._tree
        coarse, spacing = self._coarse
        found = np.empty((len(points), CANDIDATES), np.intp)
        far = np.asarray(coarse.query(points)[0]) > FAR * spacing
        found[far] = face[::COARSE][np.asarray(coarse.query(points[far], k=CANDIDATES)[1])]
        found[~far] = face[np.asarray(tree.query(points[~far], k=CANDIDATES)[1])]
        return found

    @cached_property
    def _coarse(self) -> "tuple[KDTree, float]":
        """A tree of some of the points, and the distance that these would have if they were even by area."""
        from scipy.spatial import KDTree

        assert self.corners is not None
        some = self._tree[0].data[::COARSE]
        area = float(
            lengths(cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])).sum()
        )
        return KDTree(some), float(np.sqrt(area / 2 / len(some)))

    @cached_property
    def _tree(self) -> "tuple[KDTree, NDArray[np.intp]]":
        """The points among which the nearest are looked up, and the triangle of each."""
        from scipy.spatial import KDTree  # not above: it takes long to load

        if self.corners is None:
            return KDTree(self.points), np.arange(len(self.points))
        count = min(DENSE, PER_FACE * len(self.corners))
        points, face = spread_points(self.corners, count, np.random.default_rng(0))
        along, own = _along(self.corners, count)
        middles = self.corners.mean(1)
        return KDTree(np.concatenate([points, along, middles])), np.concatenate([face, own, np.arange(len(middles))])


def _along(corners: Float, count: int) -> tuple[Float, NDArray[np.intp]]:
    """Return (count, 3) points spread evenly by length over the longest edges of the triangles (F, 3, 3), and (count,)
    the triangle of each: also a thin one gets many."""
    edges = np.roll(corners, -1, axis=1) - corners
    own, longest = np.arange(len(corners)), lengths(edges).argmax(1)
    start, edge = corners[own, longest], edges[own, longest]
    size = lengths(edge)
    ends = np.cumsum(size)
    places = (np.arange(count) + 0.5) / count * ends[-1]
    face = np.minimum(np.searchsorted(ends, places), len(ends) - 1)
    share = (places - ends[face] + size[face]) / np.maximum(size[face], np.finfo(float).tiny)
    return start[face] + share[:, None] * edge[face], face
