"""Triangles that lie in one another: in one plane, and with an area in common.

Every pair is found, to the rounding of float32, as labels depend on it; scene.derived.coincidence looks for faces to
warn of, by the middles of some, and as far apart as no renderer can tell.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.triangles import unit_normals, unit_vectors

# Of coordinates of about one, as float32 has them: 6e-8 each, and 1e-4 of a normal where a triangle is 1e-3 long.
SAME_PLANE = 1e-4  # by which normals and offsets of one plane may differ
IN_PLANE = 2e-6  # off a plane, still in it
IN_COMMON = 1e-6  # width of what two triangles share: those that share an edge have less
ASLANT = (0.43, 0.57, 0.7)  # a direction in which few planes of a model have no extent
APART = 8  # more than the extent of all coordinates, so that planes follow one another
MAX_CANDIDATES = 30_000_000  # pairs that are looked at: some seconds; what a mesh has beyond is not found
CHUNK = 1 << 18  # candidates that are looked at together

Pairs = NDArray[np.intp]


def overlapping(corners: Float) -> Pairs:
    """Return (P, 2) the pairs of the triangles (F, 3, 3), of coordinates of about one, that overlap; the lower number
    first."""
    normals = unit_normals(corners)
    normals *= np.where(normals[np.arange(len(normals)), np.abs(normals).argmax(1)] < 0, -1.0, 1.0)[:, None]
    offsets = (normals * corners.mean(1)).sum(1)
    planes = _linked(np.column_stack([offsets, normals]), SAME_PLANE)
    found = [_overlapping(corners, normals, pairs) for pairs in _candidates(corners, planes)]
    return np.sort(np.concatenate([np.zeros((0, 2), np.intp), *found]), axis=1)


def _linked(values: Float, apart: float) -> NDArray[np.intp]:
    """Return (F,) a number for each row of the `values` (F, K). Rows have the same number where steps of at most
    `apart`, in every column, lead from one to the other by way of such rows."""
    group = np.zeros(len(values), np.intp)
    for column in values.T:
        order = np.lexsort((column, group))
        starts = (np.diff(column[order]) > apart) | (np.diff(group[order]) > 0)
        group[order[1:]] = np.cumsum(starts)
        group[order[:1]] = 0
    return group


def _candidates(corners: Float, planes: NDArray[np.intp]) -> Iterator[Pairs]:
    """Yield (n, 2) pairs of triangles of one plane whose boxes overlap, some at a time."""
    places = (corners * ASLANT).sum(-1)
    low, high = (np.asfortranarray(each) for each in (corners.min(1), corners.max(1)))
    order = np.lexsort((places.min(1), planes))
    start = APART * planes[order] + places.min(1)[order]
    end = np.searchsorted(start, APART * planes[order] + places.max(1)[order], side="right")
    count = end - np.arange(len(order)) - 1
    total = np.cumsum(count)
    for first in range(0, min(int(total[-1]) if len(total) else 0, MAX_CANDIDATES), CHUNK):
        number = np.arange(first, min(first + CHUNK, int(total[-1])))
        one = np.searchsorted(total, number, side="right")
        other = one + 1 + number - (total[one] - count[one])
        one, other = order[one], order[other]
        for least, most in zip(low.T, high.T, strict=True):
            near = np.minimum(most[one], most[other]) - np.maximum(least[one], least[other]) > -IN_PLANE
            one, other = one[near], other[near]
        yield np.column_stack([one, other])


def _overlapping(corners: Float, normals: Float, pairs: Pairs) -> Pairs:
    """Return those of the `pairs` (n, 2) that lie in one plane and share an area: no line along an edge of either
    separates them (the theorem of separating axes)."""
    first, second = pairs.T
    off = np.abs(((corners[second] - corners[first, :1]) * normals[first, None]).sum(-1)).max(1)
    pairs = pairs[off <= IN_PLANE]
    for own in (0, 1):
        for start in range(3):
            edge = corners[pairs[:, own], (start + 1) % 3] - corners[pairs[:, own], start]
            across = unit_vectors(np.cross(normals[pairs[:, 0]], edge))
            one, other = ((corners[each] * across[:, None]).sum(-1) for each in pairs.T)
            shared = np.minimum(one.max(1), other.max(1)) - np.maximum(one.min(1), other.min(1))
            pairs = pairs[shared > IN_COMMON]
    return pairs
