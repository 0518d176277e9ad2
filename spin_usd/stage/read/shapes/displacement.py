"""Displacement that moves the mesh itself, so that silhouette and labels move with it.

Each point moves along the mean normal of the corners that meet there, by the mean of their displacements (weighted by
their angles), so that neither hard edges nor texture seams open. Lengths are of the gprim's own axes. Triangles are
split first until their edges span at most MAX_TEXELS texels of the displacement's image.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.derived.lookup import look_up, placed
from spin_usd.scene.texture import Primvar, Scalar, Texture
from spin_usd.stage.read.shapes.tessellate import tessellated, welded
from spin_usd.stage.read.shapes.triangles import Int, Triangles, face_normals, unit

MAX_TEXELS = 1.5
CHUNK = 2**18  # look-ups at a time
STEPS = 4095  # normals closer than one step belong to one smooth surface
MAX_DISPLACEMENT = 100.0  # times the mesh's own extent: beyond any relief of a surface
OPPOSED = 1e-6  # of the summed weights: below this the normals at a point cancel


def displaced(triangles: Triangles, of: Int, amounts: Sequence[Scalar], where: object) -> Triangles:
    """Move `triangles` (T) by amounts[of] (T,) and recompute normals; the same object where all are 0.

    Raises UnsupportedError where the image asks for too many triangles, or where two sheets lie back to back;
    StageError for a displacement of more than MAX_DISPLACEMENT times the extent of the mesh.
    """
    if not any(amounts[number] != 0 for number in np.unique(of)):
        return triangles
    triangles = welded(triangles)
    measure = np.zeros((len(triangles.corners), 3, 2))
    for number, amount in enumerate(amounts):
        if isinstance(amount, Texture):
            height, width = amount.image.size
            measure[of == number] = _coordinates(amount, triangles)[of == number] * [width, height]
    triangles, parent = tessellated(triangles, measure, MAX_TEXELS, where)
    of = of[parent]
    length = np.zeros((len(triangles.corners), 3))
    for number, amount in enumerate(amounts):
        length[of == number] = _lengths(amount, triangles.kept(of == number))
    _check_length(triangles, length, where)
    return _moved(triangles, length, where).with_area()


def _check_length(triangles: Triangles, length: Float, where: object) -> None:
    corners = triangles.points[triangles.corners].reshape(-1, 3)
    extent, largest = float(np.linalg.norm(np.ptp(corners, axis=0))), float(np.abs(length).max(initial=0))
    if not largest <= MAX_DISPLACEMENT * extent:
        found = f"is displaced by {largest:g}, more than {MAX_DISPLACEMENT:g} times its own extent of {extent:g}"
        raise StageError(found, where=where, do="make its material's inputs:displacement smaller")


def _coordinates(texture: Texture, triangles: Triangles) -> Float:
    """Return the corners' coordinates (T, 3, 2) on the image."""
    at = texture.coordinates
    if at.primvar is None:
        return np.broadcast_to(placed(at, np.array([at.constant])), (len(triangles.corners), 3, 2))
    return placed(at, triangles.primvars[at.primvar].reshape(-1, 2)).reshape(-1, 3, 2)


def _lengths(amount: Any, triangles: Triangles) -> Float:
    """Return the displacement (T, 3) of the corners."""
    if isinstance(amount, Primvar):
        return triangles.primvars[amount.name][..., 0]
    if not isinstance(amount, Texture):
        return np.full((len(triangles.corners), 3), float(amount))
    st = _coordinates(amount, triangles).reshape(-1, 2)
    parts = [look_up(amount, st[i : i + CHUNK])[:, 0] for i in range(0, len(st), CHUNK)]
    return np.concatenate([*parts, np.zeros(0)]).reshape(-1, 3)


def _moved(triangles: Triangles, length: Float, where: object) -> Triangles:
    corners, normals = triangles.corners, triangles.normals
    angle = _angles(triangles.points[corners])
    flat, count, weight = corners.reshape(-1), len(triangles.points), angle.reshape(-1)
    total = np.bincount(flat, weight, minlength=count)
    mean = _sums(flat, normals.reshape(-1, 3) * weight[:, None], count)
    if (np.linalg.norm(mean, axis=1)[total > 0] < OPPOSED * total[total > 0]).any():
        do = "give the sheets a distance, or displace one of them"
        raise UnsupportedError("is displaced where two of its faces lie back to back", where=where, do=do)
    height = np.bincount(flat, length.reshape(-1) * weight, minlength=count) / np.where(total > 0, total, 1)
    points = triangles.points + height[:, None] * unit(mean)
    outward = (normals * face_normals(triangles.points, corners)[:, None]).sum(-1, keepdims=True)
    smooth = _smoothed(replace(triangles, points=points), _angles(points[corners]))
    return replace(triangles, points=points, normals=np.where(outward < 0, -smooth, smooth))


def _smoothed(triangles: Triangles, angle: Float) -> Float:
    """Compute normals (T, 3, 3) of moved triangles: the mean over the faces of a point whose old normals were equal
    there."""
    code = np.round((triangles.normals.reshape(-1, 3) + 1) * STEPS).astype(np.int64)
    bits = np.int64(2 * STEPS + 1)
    key = ((triangles.corners.reshape(-1) * bits + code[:, 0]) * bits + code[:, 1]) * bits + code[:, 2]
    group = np.unique(key, return_inverse=True)[1].reshape(-1)
    faces = np.repeat(face_normals(triangles.points, triangles.corners), 3, axis=0)
    sums = _sums(group, faces * angle.reshape(-1, 1), int(group.max()) + 1)
    return unit(sums[group]).reshape(-1, 3, 3)


def _sums(group: NDArray[Any], values: Float, count: int) -> Float:
    return np.stack([np.bincount(group, values[:, i], minlength=count) for i in range(3)], 1)


def _angles(points: Float) -> Float:
    """Compute the angle (T, 3) of each corner of triangles (T, 3, 3)."""
    to_next = np.roll(points, -1, axis=1) - points
    to_last = np.roll(points, 1, axis=1) - points
    sine = np.linalg.norm(np.cross(to_next, to_last), axis=-1)
    angle: Float = np.arctan2(sine, (to_next * to_last).sum(-1))
    return angle
