"""The share of a surface's visible side that faces a light, from the directions of camera and light alone.

A face is seen from the side on which the camera is, and is lit where the light is on the same side, whichever way its
corners go around. Occlusion is ignored: every face counts by the area that it turns to the camera.
"""

import numpy as np

from spin_usd.basics.arrays import Float

STEPS = 4  # on each side of a cube, from its middle to its rim: faces within some 14 degrees count together
CHUNK = 1 << 20  # directions of faces worked on at once


def few_axes(area_vectors: Float) -> Float:
    """Return (A, 3) few directions for the many faces with the `area_vectors` (F, 3), which stand across them, either
    way, and are as long as their areas: the sums of those that are near to each other."""
    sums = np.zeros((3 * (2 * STEPS + 1) ** 2, 3))
    for start in range(0, len(area_vectors), CHUNK):
        cell, upright = _cells(area_vectors[start : start + CHUNK])
        for axis in range(3):
            sums[:, axis] += np.bincount(cell, upright[:, axis], len(sums))
    return sums[sums.any(1)]


def facing_share(axes: Float, to_camera: Float, to_light: Float) -> Float:
    """Return (M,) the share, of what a camera in the unit directions `to_camera` (M, 3) sees, that faces a light in the
    directions `to_light` (M, 3). axes: as of `few_axes`."""
    shares = np.empty(len(to_camera))
    step = max(CHUNK // len(axes), 1)
    for start in range(0, len(shares), step):
        some = slice(start, start + step)
        shown = to_camera[some] @ axes.T
        lit = shown * (to_light[some] @ axes.T) > 0
        area = np.abs(shown)
        shares[some] = (area * lit).sum(1) / np.maximum(area.sum(1), np.finfo(float).tiny)
    return shares


def _cells(normal: Float) -> tuple[np.ndarray, Float]:
    """Return the cells (F,) of the half cube to which the normals (F, 3) point once they are flipped so that their
    longest component is positive, and these flipped normals (F, 3)."""
    axis = np.abs(normal).argmax(1)
    longest = np.take_along_axis(normal, axis[:, None], 1)
    upright = np.where(longest < 0, -normal, normal)
    across = STEPS * upright / np.maximum(np.abs(longest), np.finfo(float).tiny)
    u, v = (np.take_along_axis(across, (axis[:, None] + i) % 3, 1)[:, 0] for i in (1, 2))
    side = 2 * STEPS + 1
    return (axis * side + np.rint(u).astype(int) + STEPS) * side + np.rint(v).astype(int) + STEPS, upright
