"""A facet: the plane region of a mesh around one of its triangles, however it is cut into triangles.

A person sees its corners, edges and centre, and a picked point can snap to them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.triangles import areas, normals, unit_normals, unit_vectors

FLAT = 1e-6  # of the mesh's size, by which a corner may stand out of the plane: float32 rounds to a tenth of it
STRAIGHT = 1e-9  # 1 less the cosine between two edges that make one


@dataclass(frozen=True, kw_only=True, eq=False)
class Facet:
    """A part of a surface in one plane."""

    corners: Float
    """(F, 3, 3): corners of its triangles."""

    @classmethod
    def around(cls, points: Float, faces: NDArray[np.integer], face: int) -> "Facet":
        """Return the facet of the mesh with these `points` (P, 3) and triangles `faces` (F, 3) that holds the triangle
        number `face`."""
        plane = unit_normals(points[faces[face]])
        near = np.abs((points - points[faces[face, 0]]) @ plane) <= FLAT * float(np.ptp(points, axis=0).max())
        there = np.flatnonzero(near[faces].all(1))
        same_way = normals(points[faces[there]]) @ plane > 0
        there = np.union1d(there[same_way], [face])
        corners = points[faces[there]]
        return cls(corners=corners[_connected(corners, int(np.searchsorted(there, face)))])

    @cached_property
    def vertices(self) -> Float:
        """(V, 3) its triangles' corners, each once."""
        vertices: Float = np.unique(self.corners.reshape(-1, 3), axis=0)
        return vertices

    @cached_property
    def edges(self) -> Float:
        """(E, 2, 3) the ends of the straight edges around it, without edges between its own triangles."""
        points, ends = _welded_edges(self.corners)
        ends, counts = np.unique(ends, axis=0, return_counts=True)
        return _joined(points, ends[counts == 1])

    @property
    def edge_midpoints(self) -> Float:
        """(E, 3) the middles of its edges."""
        middles: Float = self.edges.mean(1)
        return middles

    @property
    def centre(self) -> Float:
        """(3,) its centre of area."""
        area = areas(self.corners)
        if not area.sum() > 0:
            return np.asarray(self.corners.mean((0, 1)))
        return np.asarray((self.corners.mean(1) * area[:, None]).sum(0) / area.sum())


def _welded_edges(corners: Float) -> tuple[Float, NDArray[np.intp]]:
    """Return the places (V, 3) of the corners (F, 3, 3), and the three edges of each triangle (3 F, 2) between them,
    the lower number first."""
    points, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = index.reshape(-1, 3)
    return points, np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)


def _connected(corners: Float, first: int) -> NDArray[np.bool_]:
    """Return (F,) whether shared edges lead from the triangle `first` to each of the triangles (F, 3, 3)."""
    _, ends = _welded_edges(corners)
    edge = np.unique(ends, axis=0, return_inverse=True)[1].reshape(-1)
    triangle = np.repeat(np.arange(len(corners)), 3)
    group = _components(np.column_stack([triangle, len(corners) + edge]), len(corners) + len(edge))[: len(corners)]
    return np.asarray(group == group[first])


def _joined(points: Float, ends: NDArray[np.intp]) -> Float:
    """Return (E, 2, 3) the edges `ends` (n, 2) between the `points`; those that go on straight, where no third one
    meets them, as one."""
    along = unit_vectors(points[ends[:, 1]] - points[ends[:, 0]])
    edge, vertex = np.repeat(np.arange(len(ends)), 2), ends.reshape(-1)
    order = np.argsort(vertex, kind="stable")
    edge, vertex = edge[order], vertex[order]
    _, firsts, counts = np.unique(vertex, return_index=True, return_counts=True)
    pairs = np.column_stack([edge[firsts[counts == 2]], edge[firsts[counts == 2] + 1]])
    straight = np.abs((along[pairs[:, 0]] * along[pairs[:, 1]]).sum(1)) >= 1 - STRAIGHT
    chain = _components(pairs[straight], len(ends))
    return np.array([_ends(points[ends[chain == each]].reshape(-1, 3)) for each in np.unique(chain)]).reshape(-1, 2, 3)


def _ends(points: Float) -> Float:
    """Return (2, 3) the two ends of points (N, 3) on one line."""
    along = (points - points[0]) @ (points[np.argmax(np.linalg.norm(points - points[0], axis=1))] - points[0])
    return points[[np.argmin(along), np.argmax(along)]]


def _components(pairs: NDArray[np.intp], count: int) -> NDArray[np.integer]:
    """Return (count,) a number for each node, the same where the `pairs` (n, 2) lead from one to the other."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1])
