"""UsdGeom.Mesh as triangles: any face size, with or without subdivision; its arrays are checked first."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.geometry.triangles import newell
from spin_usd.stage.read.shapes.primvars import Corners, FoundPrimvar, known_interpolation
from spin_usd.stage.read.shapes.skeletons import Deformation
from spin_usd.stage.read.shapes.subdivision import SCHEMES, subdivided
from spin_usd.stage.read.shapes.triangles import Int, Triangles, face_normals, unit
from spin_usd.stage.usd.values import VECTORS, array, read, refuse

MAX_CONCAVE_CORNERS = 2000  # ear clipping takes time with the cube of it
# A smaller angle, in radians, counts as straight: points are float32.
STRAIGHT = 1e-6


def read_mesh(
    prim: Usd.Prim, time: Usd.TimeCode, primvars: Sequence[FoundPrimvar] = (), deformation: Deformation | None = None
) -> Triangles:
    """Read triangles in the mesh's own axes, stage units, with `primvars` at their corners; `source` is the authored
    face. A skeleton deforms the points before they are subdivided, as in USD.

    Scheme none: normals as authored, else flat. Other schemes: see `subdivided`. Raises StageError for arrays that are
    not a valid mesh, UnsupportedError for a scheme that USD does not have.
    """
    mesh = UsdGeom.Mesh(prim)
    points, counts, indices = _checked_topology(mesh, time, deformation)
    scheme = read(mesh.GetSubdivisionSchemeAttr())
    if scheme == UsdGeom.Tokens.none:
        triangles = _polygonal(mesh, time, points, counts, indices, primvars, deformation)
    elif scheme in SCHEMES:
        triangles = subdivided(mesh, time, points, counts, indices, primvars)
    else:
        do = f"use {', '.join(SCHEMES)} or none"
        raise UnsupportedError(f"has subdivision scheme '{scheme}'", where=prim.GetPath(), do=do)
    triangles = _without_holes(mesh, time, triangles, len(counts)).with_area()
    if not len(triangles.corners):
        raise StageError("has no face with an area", where=prim.GetPath(), do="remove the mesh or fix its faces")
    return triangles.flipped() if read(mesh.GetOrientationAttr()) == UsdGeom.Tokens.leftHanded else triangles


def _checked_topology(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, deformation: Deformation | None
) -> tuple[Float, Int, Int]:
    """Read points (P, 3), corners of each face (F,), and indices. Raises StageError with the first wrong number."""
    where = mesh.GetPath()
    if mesh.GetVelocitiesAttr().HasAuthoredValue():
        points = np.array(mesh.ComputePointsAtTime(time, time), np.float64).reshape(-1, 3)
    else:
        points = array(mesh.GetPointsAttr(), time, np.float64).reshape(-1, 3)
    counts = array(mesh.GetFaceVertexCountsAttr(), time, np.int64)
    indices = array(mesh.GetFaceVertexIndicesAttr(), time, np.int64)
    if not len(counts) or not len(points):
        raise StageError(
            f"is a mesh of {len(points)} points and {len(counts)} faces", where=where, do="fill or remove it"
        )
    refuse(counts < 3, "faceVertexCounts", counts, "a face needs 3 corners", where)
    if counts.sum() != len(indices):
        found = f"faceVertexCounts require {counts.sum()} indices, faceVertexIndices holds {len(indices)}"
        raise StageError(found, where=where, do="fix the mesh")
    refuse(
        (indices < 0) | (indices >= len(points)), "faceVertexIndices", indices, f"there are {len(points)} points", where
    )
    if deformation:
        points = deformation.points(points)
        refuse(~np.isfinite(points).all(1), "points", points, "its skeleton must keep them finite", where)
    return points, counts, indices


def _polygonal(
    mesh: UsdGeom.Mesh,
    time: Usd.TimeCode,
    points: Float,
    counts: Int,
    indices: Int,
    primvars: Sequence[FoundPrimvar],
    deformation: Deformation | None,
) -> Triangles:
    positions, source, crossing = triangulate(points, counts, indices, mesh.GetPath())
    corners = indices[positions]
    at = Corners(positions=positions, points=corners, faces=source, counts=(len(indices), len(points), len(counts)))
    flat = np.repeat(face_normals(points, corners)[:, None], 3, axis=1)
    if read(mesh.GetOrientationAttr()) == UsdGeom.Tokens.leftHanded:
        flat = -flat
    normals, turned = _authored_normals(mesh, time, at), np.zeros(0, np.int64)
    if normals is not None:
        own = deformation.normals(normals, corners, len(points)) if deformation else unit(normals)
        against = (own.sum(1) * flat[:, 0]).sum(-1) < 0  # path tracers would show black there
        turned = np.setdiff1d(source[against], crossing)
        own = np.where(against[:, None, None], -own, own)
        flat = np.where((normals != 0).any(-1, keepdims=True), own, flat)
    return Triangles(
        points=points,
        corners=corners,
        normals=flat,
        source=source,
        mended={"faces-crossing": crossing, "normals-turned": turned},
        primvars={p.name: p.elements[at.elements(p.interpolation, len(p.indices), p.where)] for p in primvars},
    )


def _authored_normals(mesh: UsdGeom.Mesh, time: Usd.TimeCode, at: Corners) -> Float | None:
    """Read the authored normals (T, 3, 3), or None. primvars:normals wins over normals, and its indices are used."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        read(primvar.GetAttr(), time, *VECTORS)
        name, value, interpolation = "primvars:normals", primvar.ComputeFlattened(time), primvar.GetInterpolation()
    else:
        name, value, interpolation = "normals", read(mesh.GetNormalsAttr(), time), mesh.GetNormalsInterpolation()
    if value is None:
        return None
    normals, where = np.array(value, np.float64).reshape(-1, 3), f"{mesh.GetPath()}.{name}"
    elements = at.elements(known_interpolation(str(interpolation), where), len(normals), where)
    result: Float = normals[elements]
    return result


def _without_holes(mesh: UsdGeom.Mesh, time: Usd.TimeCode, triangles: Triangles, faces: int) -> Triangles:
    holes = array(mesh.GetHoleIndicesAttr(), time, np.int64)
    refuse((holes < 0) | (holes >= faces), "holeIndices", holes, f"there are {faces} faces", mesh.GetPath())
    return triangles.kept(~np.isin(triangles.source, holes)) if len(holes) else triangles


def triangulate(points: Float, counts: Int, indices: Int, where: object) -> tuple[Int, Int, Int]:
    """Return triangles (T, 3) as positions in `indices`, the face (T,) of each, in face order, and which faces cross
    themselves.

    points (P, 3); counts (F,) corners of each face; indices (sum of counts,). Convex faces are cut as a fan, as Hydra
    does. Concave faces are cut by their ears in the plane that fits them; those that cross themselves are a fan, as
    Hydra shows them.
    """
    starts = np.cumsum(counts) - counts
    corners, source, crossing = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for size in np.unique(counts):
        faces = np.flatnonzero(counts == size)
        ring = starts[faces][:, None] + np.arange(size)
        convex, empty = np.ones(len(faces), bool), np.zeros(len(faces), bool)
        if size > 3:
            convex, empty = _convex(points[indices[ring]])
        crossing.append(faces[empty])
        fan = np.stack([np.zeros(size - 2, int), np.arange(1, size - 1), np.arange(2, size)], -1)
        corners.append(ring[convex][:, fan].reshape(-1, 3))
        source.append(np.repeat(faces[convex], size - 2))
        for face, own in zip(faces[~convex], ring[~convex], strict=True):
            ears = _clip_ears(_flattened(points[indices[own]]), f"{where} face {face}")
            crossing.append(np.full(int(ears is None), face))
            corners.append(own[fan if ears is None else ears])
            source.append(np.full(size - 2, face))
    order = np.argsort(np.concatenate(source), kind="stable")
    return np.concatenate(corners)[order], np.concatenate(source)[order], np.concatenate(crossing)


def _convex(polygons: Float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which of the polygons (K, n, 3) are convex, and which have triangles whose areas cancel out. Those without
    area count as convex: a fan of them loses nothing."""
    normal = newell(polygons)
    size = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0)
    after = np.roll(polygons, -1, axis=1) - polygons
    before = np.roll(after, 1, axis=1)
    sine = (np.cross(before, after) * normal[:, None]).sum(-1)
    turn = np.arctan2(sine, (before * after).sum(-1))
    once: NDArray[np.bool_] = (turn > -STRAIGHT).all(1) & (turn.sum(1) < 3 * np.pi)
    empty: NDArray[np.bool_] = size[:, 0] == 0
    cancelled = empty & np.linalg.norm(np.cross(after, np.roll(after, -1, axis=1)), axis=-1).any(-1)
    return np.logical_or(once, empty), cancelled


def _flattened(polygon: Float) -> Float:
    """Project the polygon (n, 3) to the plane that fits it, (n, 2), counter-clockwise."""
    normal = newell(polygon)
    normal /= np.linalg.norm(normal)
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    plane: Float = np.stack([u, np.cross(normal, u)], -1)
    return np.asarray((polygon - polygon[0]) @ plane, np.float64)


def _clip_ears(p: Float, where: str) -> Int | None:
    """Cut a simple polygon (n, 2), counter-clockwise, into triangles (n - 2, 3); None for one that crosses itself.

    Source: G. H. Meisters, "Polygons have ears" (1975).
    """
    if len(p) > MAX_CONCAVE_CORNERS:
        raise UnsupportedError(f"is concave and has {len(p)} corners", where=where, do="triangulate it")
    if _crosses(p):
        return None
    rest, ears = list(range(len(p))), []
    while len(rest) > 3:
        # A corner on a straight line goes last, so that it stays a corner of some triangle where it can.
        corners = range(len(rest))
        ear = next(
            (i for i in corners if _is_ear(p, rest, i)), next((i for i in corners if _straight(p, rest, i)), None)
        )
        if ear is None:
            return None
        ears.append([rest[ear - 1], rest[ear], rest[(ear + 1) % len(rest)]])
        del rest[ear]
    return np.array([*ears, rest])


def _crosses(p: Float) -> bool:
    """Return whether two edges of a polygon (n, 2) cross; touching does not count."""
    q = np.roll(p, -1, axis=0)
    side_p = _cross((q - p)[:, None], p[None] - p[:, None])  # of each edge's line, every corner
    side_q = np.roll(side_p, -1, axis=1)
    apart = side_p * side_q < -((STRAIGHT * np.ptp(p, axis=0).max() ** 2) ** 2)
    return bool((apart & apart.T).any())


def _is_ear(p: Float, rest: list[int], i: int) -> bool:
    """Return whether corner i of the rest can be cut off: it is convex and no corner lies within the triangle."""
    a, b, c = p[rest[i - 1]], p[rest[i]], p[rest[(i + 1) % len(rest)]]
    if _cross(b - a, c - b) <= 0 or _straight(p, rest, i):
        return False
    others = p[[k for k in rest if k not in (rest[i - 1], rest[i], rest[(i + 1) % len(rest)])]]
    inside = (_cross(b - a, others - a) >= 0) & (_cross(c - b, others - b) >= 0) & (_cross(a - c, others - c) >= 0)
    touching = (others[:, None] == np.stack([a, b, c])).all(-1).any(1)  # a bridge to a hole visits a corner twice
    return not (inside & ~touching).any()


def _straight(p: Float, rest: list[int], i: int) -> bool:
    """Return whether corner i of the rest lies on the line between its neighbours."""
    before, after = p[rest[i]] - p[rest[i - 1]], p[rest[(i + 1) % len(rest)]] - p[rest[i]]
    return bool(abs(_cross(before, after)) <= STRAIGHT * np.linalg.norm(before) * np.linalg.norm(after))


def _cross(a: Float, b: Float) -> Float:
    result: Float = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result
