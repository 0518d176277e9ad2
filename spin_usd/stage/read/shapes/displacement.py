"""Displacement that moves the mesh itself, so that silhouette and labels move with it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.scene.derived.lookup import look_up, placed
from spin_usd.scene.texture import Primvar, Scalar, Texture
from spin_usd.stage.read.shapes.triangles import Int, Triangles, face_normals, unit

MAX_TEXELS = 1.5
CHUNK = 2**18  # look-ups at a time
STEPS = 4095  # normals closer than one step belong to one smooth surface
MAX_DISPLACEMENT = 100.0  # times the mesh's own extent: beyond any relief of a surface
OPPOSED = 1e-6  # of the summed weights: below this the normals at a point cancel
MAX_TRIANGLES = 2**22
SAME = 1e-6  # of the longest extent: nearer points are merged; USD's float32 resolves 6e-8
# Corners 0 to 2 and the middles 3 to 5 of the edges 01, 12, 20, by which edges are halved (1, 2 and 4, added).
PATTERNS = (
    ((0, 1, 2),),
    ((0, 3, 2), (3, 1, 2)),
    ((0, 1, 4), (0, 4, 2)),
    ((3, 1, 4), (0, 3, 4), (0, 4, 2)),
    ((0, 1, 5), (5, 1, 2)),
    ((5, 0, 3), (3, 1, 2), (3, 2, 5)),
    ((4, 2, 5), (0, 1, 4), (0, 4, 5)),
    ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
)


def displaced(triangles: Triangles, of: Int, amounts: Sequence[Scalar], where: object) -> Triangles:
    """Move `triangles` (T) by amounts[of] (T,) and recompute normals; the same object where all are 0.

    Each point moves along the mean normal of the corners that meet there, by the mean of their displacements (weighted
    by their angles), so that neither hard edges nor texture seams open. Lengths are of the gprim's own axes. Triangles
    are split first until their edges span at most MAX_TEXELS texels of the displacement's image.

    Raises UnsupportedError if the image needs too many triangles, or if two sheets lie back to back; StageError for a
    displacement of more than MAX_DISPLACEMENT times the extent of the mesh.
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


def welded(triangles: Triangles) -> Triangles:
    """Merge points that differ only by rounding into the first of them."""
    from scipy.sparse import coo_array  # not above: scipy is slow to load, and few need it
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    points, place = np.unique(triangles.points + 0.0, axis=0, return_inverse=True)
    close = cKDTree(points).query_pairs(SAME * float(np.ptp(points, axis=0).max()), output_type="ndarray")
    links = coo_array((np.ones(len(close)), (close[:, 0], close[:, 1])), shape=(len(points),) * 2)
    cluster = connected_components(links, directed=False)[1].astype(np.int64)
    first = np.unique(cluster, return_index=True)[1]
    return replace(triangles, points=points[first], corners=cluster[place.reshape(-1)][triangles.corners])


def tessellated(triangles: Triangles, measure: Float, longest: float, where: object) -> tuple[Triangles, Int]:
    """Split welded `triangles` until no edge is longer than `longest`, measured between the coordinates `measure` (T,
    3, 2) of their corners. Returns them, and the original triangle (N,) of each.

    No cracks open: an edge is halved for all triangles that have it or for none. Normals and primvars are interpolated.
    Raises UnsupportedError beyond MAX_TRIANGLES.
    """
    parent = np.arange(len(triangles.corners))
    while True:
        lengths = np.linalg.norm(measure - np.roll(measure, -1, axis=1), axis=-1)
        halved, middle, points = _halved(triangles, lengths > longest)
        if not halved.any():
            return triangles, parent
        pattern = halved @ [1, 2, 4]
        count = sum(len(PATTERNS[p]) * n for p, n in enumerate(np.bincount(pattern)))
        if count > MAX_TRIANGLES:
            found = f"needs more than {MAX_TRIANGLES} triangles to follow the texels of its displacement"
            raise UnsupportedError(found, where=where, do="use a smaller image, or fewer repetitions of it")
        order = np.concatenate([np.repeat(np.flatnonzero(pattern == p), len(t)) for p, t in enumerate(PATTERNS)])
        local = np.concatenate([np.tile(t, (int((pattern == p).sum()), 1)) for p, t in enumerate(PATTERNS)])
        row = order[:, None]
        triangles = replace(
            triangles,
            points=points,
            corners=np.concatenate([triangles.corners, middle], 1)[row, local],
            normals=unit(_with_middles(triangles.normals)[row, local]),
            source=triangles.source[order],
            primvars={name: _with_middles(values)[row, local] for name, values in triangles.primvars.items()},
        )
        measure, parent = _with_middles(measure)[row, local], parent[order]


def _halved(triangles: Triangles, marked: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], Int, Float]:
    """Return which edges (T, 3) are halved, the points (T, 3) in their middles, and all points with those."""
    following = np.roll(triangles.corners, -1, axis=1)
    low, high = np.minimum(triangles.corners, following), np.maximum(triangles.corners, following)
    number = len(triangles.points)
    keys, edge = np.unique((low * number + high).reshape(-1), return_inverse=True)
    edge = edge.reshape(-1, 3)
    chosen = np.zeros(len(keys), bool)
    chosen[edge[marked]] = True
    new = np.cumsum(chosen) - 1 + number
    a, b = keys[chosen] // number, keys[chosen] % number
    points = np.concatenate([triangles.points, (triangles.points[a] + triangles.points[b]) / 2])
    return chosen[edge], np.where(chosen[edge], new[edge], 0), points


def _with_middles(values: Float) -> Float:
    """Return `values` (T, 3, C) at the corners, then in the middles of the edges, (T, 6, C)."""
    return np.concatenate([values, (values + np.roll(values, -1, axis=1)) / 2], 1)
