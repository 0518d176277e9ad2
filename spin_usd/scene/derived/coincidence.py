"""Faces of a mesh that coincide within a renderer's resolution: pictures of them have wrong light.

The middles of some faces are tested. The caster finds every pair that lies in one plane.
"""

from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.triangles import affine, cross, dot
from spin_usd.scene.derived.faces import corners_of
from spin_usd.scene.instances import Instances
from spin_usd.scene.mesh import Mesh

# Of the target's radius. A renderer's float32 resolves a range of 16 radii, beyond which its rays start at the target,
# to 2**-24 of that: surfaces nearer to each other are rendered in random order.
GAP = 2.0**-20
MAX_MIDDLES = 100_000  # of a mesh with more faces, evenly spread ones are looked at
CHUNK = 4096  # faces whose neighbourhoods are looked at together
MAX_NEIGHBOURS = 30_000_000  # in all: some seconds; further pairs of a mesh of huge crossing faces are not tested
WITHIN = np.array([0.362, 0.335, 0.303])  # near the middle, and on no diagonal of a doubled quadrilateral
SPARSE = 4  # faces of a copy for each middle nearby, from which on most of them are far from all
MAX_AT_ONCE = 1_000_000  # neighbours of some copies; with more, all of their faces count as near
EVEN = 1e-5  # by which scales along a copy's axes may differ: float32 leaves less
INSIDE = 1e-6  # least weight: a middle so near to an edge lies beside the face

Numbers = NDArray[np.intp]


def evenly_spread(mesh: Mesh) -> NDArray[np.intp]:
    """Return (M,) all faces of `mesh`, or of very many MAX_MIDDLES at most."""
    return np.arange(0, mesh.count, -(-mesh.count // MAX_MIDDLES))


def coincident_faces(mesh: Mesh, chosen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return (K, 2) pairs of faces: the first, of the `chosen` (M,), has its middle in the second, any face, or too
    close to it for a renderer to resolve.

    Both orders of a pair are included if the faces are alike.
    """
    middles = np.einsum("nci,c->ni", corners_of(mesh, chosen) - mesh.centre, WITHIN)
    found = [np.zeros((0, 2), np.intp)]
    for point, which, faces, corners in _neighbours(middles, mesh):
        inside = _lies_in(middles, point, corners, which, GAP * mesh.radius)
        found.append(np.stack([chosen[point[inside]], faces[which[inside]]], -1))
    pairs = np.concatenate(found)
    others: NDArray[np.intp] = pairs[pairs[:, 0] != pairs[:, 1]]
    return others


def _neighbours(middles: Float, mesh: Mesh) -> Iterator[tuple[Numbers, Numbers, Numbers, Float]]:
    """Yield indices (n,) of middles and (n,) of some faces in whose bounding spheres they lie, the numbers (F,) of
    these faces, and their corners (F, 3, 3) around the mesh's centre, some faces at a time."""
    from scipy.spatial import cKDTree

    tree, left = cKDTree(middles), MAX_NEIGHBOURS
    copied = [first + _near_faces(each, middles, tree, mesh.centre) for first, each in mesh.numbered]
    candidates = np.concatenate([np.arange(len(mesh.faces)), *copied])
    for start in range(0, len(candidates), CHUNK):
        faces = candidates[start : start + CHUNK]
        corners = corners_of(mesh, faces) - mesh.centre
        spheres = _bounding_spheres(corners)
        count = tree.query_ball_point(*spheres, return_length=True)
        left -= int(count.sum())
        if left < 0:
            return
        yield *_within(tree, *spheres, count), faces, corners


def _near_faces(copies: Instances, middles: Float, tree: Any, mesh_centre: Float) -> Numbers:
    """Return (N,), ascending, numbers of copies' faces: all with some `middles` (M, 3), around `mesh_centre`, in their
    bounding spheres. The few middles near a copy are moved to its shape, where it is scaled evenly."""
    from scipy.spatial import cKDTree

    linear, every = copies.matrices[..., :3], np.arange(len(copies.shape.faces))
    gram = linear.mT @ linear
    square = np.trace(gram, axis1=1, axis2=2) / 3
    even = np.abs(gram - square[:, None, None] * np.eye(3)).max((1, 2)) <= EVEN * square
    spheres, radius = _bounding_spheres(copies.shape.points[copies.shape.faces])
    middle, radius = spheres.mean(0), radius * (1 + 10 * EVEN)
    reach = (np.linalg.norm(spheres - middle, axis=1) + radius).max() * np.sqrt(square)
    centre = affine(copies.matrices, middle) - mesh_centre
    nearby = tree.query_ball_point(centre, reach, return_length=True)
    few = even & (SPARSE * nearby <= len(every))
    found, some = [np.add.outer(np.flatnonzero(~few) * len(every), every).ravel()], np.flatnonzero(few)
    for places in np.split(some, np.flatnonzero(np.diff(np.cumsum(nearby[some]) // CHUNK)) + 1):
        point, at = _within(tree, centre[places], reach[places], nearby[places])
        away = middles[point] + mesh_centre - copies.matrices[places[at], :, 3]
        own = cKDTree(np.einsum("nij,nj->ni", np.linalg.inv(linear[places])[at], away))
        count = own.query_ball_point(spheres, radius, return_length=True)
        if count.sum() > MAX_AT_ONCE:
            found.append(np.add.outer(places * len(every), every).ravel())
        else:
            which, face = _within(own, spheres, radius, count)
            found.append(np.unique(places[at[which]] * len(every) + face))
    return np.sort(np.concatenate(found))


def _within(tree: Any, centre: Float, radius: Float, count: Numbers) -> tuple[Numbers, Numbers]:
    """Return indices (n,) of points of the `tree` and (n,) of the spheres in which they lie, `count` (F,) in each."""
    some = np.flatnonzero(count)
    within = tree.query_ball_point(centre[some], radius[some], return_sorted=False)
    return np.fromiter(chain.from_iterable(within), np.intp, int(count.sum())), np.repeat(some, count[some])


def _bounding_spheres(corners: Float) -> tuple[Float, Float]:
    """Return centres (F, 3) and radii (F,) around the middles of the faces' longest edges."""
    ends = np.roll(corners, -1, axis=1)
    longest = np.linalg.norm(ends - corners, axis=2).argmax(1)
    each = np.arange(len(corners))
    centre: Float = (corners[each, longest] + ends[each, longest]) / 2
    return centre, np.linalg.norm(corners - centre[:, None], axis=2).max(1)


def _lies_in(
    points: Float, point: NDArray[np.intp], corners: Float, which: NDArray[np.intp], gap: float
) -> NDArray[np.intp]:
    """Return places (K,) in `point` (n,), indices of `points`, and `which` (n,), indices of triangles (F, 3, 3), where
    that point lies within that triangle, at most `gap` off its plane.

    Few are near the plane, and only those are tested.
    """
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = cross(u, v)
    square = np.maximum(dot(normal, normal), np.finfo(float).tiny)
    off = dot(points[point] - a[which], normal[which])
    near = np.flatnonzero(np.abs(off) <= (gap * np.sqrt(square))[which])
    which = which[near]
    w, u, v, normal, square = points[point[near]] - a[which], u[which], v[which], normal[which], square[which]
    beta, gamma = dot(cross(w, v), normal) / square, dot(cross(u, w), normal) / square
    return near[np.minimum(np.minimum(beta, gamma), 1 - beta - gamma) > INSIDE]
