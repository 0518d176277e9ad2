"""Convex bodies: seen from outside, no point of one sees another."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.triangles import areas, unit_normals

PLANE = 1e-9  # of the body's size, by which a corner may stand out of a face's plane: the rounding of its places
AREA = 1e-9  # relative
CHUNK = 1 << 22  # distances worked out at once
FEW = 64  # faces that are looked at first: of most bodies that are not convex, one of them says so
MAX_DISTANCES = 1 << 29  # from corners to faces, that are worked out at all: some seconds


def is_convex(points: Float, faces: NDArray[np.integer]) -> bool:
    """Return whether the triangles `faces` (F, 3) of `points` (P, 3) are one closed convex surface, each place of it
    covered once; whichever way they face. False too for a surface of so many corners and faces that it is not
    examined."""
    from scipy.spatial import ConvexHull, QhullError

    corners, used = points[faces], np.zeros(len(points), bool)
    used[faces] = True
    if not _supports(corners[:: -(-len(faces) // FEW)], points[used]):
        return False
    try:
        hull = ConvexHull(np.unique(points[used], axis=0))
    except (QhullError, ValueError):  # flat
        return False
    around = hull.points[hull.vertices]
    if len(around) * len(faces) > MAX_DISTANCES or not _supports(corners, around):
        return False
    area = float(areas(corners).sum())
    return abs(area - hull.area) <= AREA * hull.area and _is_closed(corners)


def _supports(corners: Float, around: Float) -> bool:
    """Return whether all of `around` (H, 3) lies on one side of the plane of each triangle (F, 3, 3)."""
    tolerance = PLANE * float(np.ptp(around, axis=0).max())
    step = max(CHUNK // len(around), 1)
    for start in range(0, len(corners), step):
        chunk = corners[start : start + step]
        normal = unit_normals(chunk)
        side = normal @ around.T - (normal * chunk[:, 0]).sum(1)[:, None]
        if ((side.min(1) < -tolerance) & (side.max(1) > tolerance)).any():
            return False
    return True


def _is_closed(corners: Float) -> bool:
    """Return whether each edge of the triangles (F, 3, 3) belongs to two of them, by the places of its ends."""
    index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.concatenate([index[:, [0, 1]], index[:, [1, 2]], index[:, [2, 0]]]), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())
