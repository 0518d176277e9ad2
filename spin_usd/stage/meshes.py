"""UsdGeom.Mesh as triangles: any face size, with or without subdivision; checked before anything else sees it."""

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage import subdivide
from spin_usd.stage.polygons import triangulate
from spin_usd.stage.triangles import Int, Triangles, face_normals, unit

LEVELS = 2  # 16 quadrangles for one; their corners lie on the limit surface
MAX_LEVELS = 4


def read_mesh(prim: Usd.Prim, time: Usd.TimeCode) -> Triangles:
    """Triangles in the mesh's own axes, stage units; `source` is the authored face.

    Scheme none: normals as authored, else flat. catmullClark: refined LEVELS times, then moved to the limit surface.
    bilinear: the same refinement with everything sharp. Raises StageError for numbers that are no mesh,
    UnsupportedError for loop, fractional creases and open boundaries (interpolateBoundary = none).
    """
    mesh = UsdGeom.Mesh(prim)
    points, counts, indices = checked_topology(mesh, time)
    scheme = mesh.GetSubdivisionSchemeAttr().Get()
    if scheme == UsdGeom.Tokens.none:
        triangles = _polygonal(mesh, time, points, counts, indices)
    elif scheme in (UsdGeom.Tokens.catmullClark, UsdGeom.Tokens.bilinear):
        triangles = _subdivided(mesh, time, points, counts, indices)
    else:
        do = "use catmullClark, bilinear or none"
        raise UnsupportedError(f"has subdivision scheme '{scheme}'", where=prim.GetPath(), do=do)
    triangles = _without_holes(mesh, time, triangles, len(counts)).with_area()
    if not len(triangles.corners):
        raise StageError("has no face with an area", where=prim.GetPath(), do="remove the mesh or mend its faces")
    return _turned(triangles) if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded else triangles


def checked_topology(mesh: UsdGeom.Mesh, time: Usd.TimeCode) -> tuple[Float, Int, Int]:
    """Points (P, 3), corners of each face (F,), and indices. Raises StageError naming the first wrong number."""
    where = mesh.GetPath()
    if mesh.GetVelocitiesAttr().HasAuthoredValue():
        points = np.array(mesh.ComputePointsAtTime(time, time), np.float64).reshape(-1, 3)
    else:
        points = _array(mesh.GetPointsAttr(), time, np.float64).reshape(-1, 3)
    counts = _array(mesh.GetFaceVertexCountsAttr(), time, np.int64)
    indices = _array(mesh.GetFaceVertexIndicesAttr(), time, np.int64)
    if not len(counts) or not len(points):
        raise StageError(
            f"is a mesh of {len(points)} points and {len(counts)} faces", where=where, do="fill or remove it"
        )
    _refuse(counts < 3, "faceVertexCounts", counts, "a face needs 3 corners", where)
    if counts.sum() != len(indices):
        found = f"faceVertexCounts ask for {counts.sum()} indices, faceVertexIndices holds {len(indices)}"
        raise StageError(found, where=where, do="mend the mesh")
    _refuse(
        (indices < 0) | (indices >= len(points)), "faceVertexIndices", indices, f"there are {len(points)} points", where
    )
    _refuse(~np.isfinite(points).all(1), "points", points, "they must be finite", where)
    return points, counts, indices


def _polygonal(mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: Float, counts: Int, indices: Int) -> Triangles:
    places, source = triangulate(points, counts, indices, mesh.GetPath())
    corners = indices[places]
    flat = np.repeat(face_normals(points, corners)[:, None], 3, axis=1)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        flat = -flat
    normals = _authored_normals(mesh, time, places, source, corners, (len(counts), len(points), len(indices)))
    if normals is not None:
        flat = np.where((normals != 0).any(-1, keepdims=True), unit(normals), flat)
    return Triangles(points=points, corners=corners, normals=flat, source=source)


def _authored_normals(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, places: Int, source: Int, corners: Int, sizes: tuple[int, int, int]
) -> Float | None:
    """(T, 3, 3), or None. primvars:normals wins over normals, and its indices are followed."""
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        name, value, interpolation = "primvars:normals", primvar.ComputeFlattened(time), primvar.GetInterpolation()
    else:
        name, value, interpolation = "normals", mesh.GetNormalsAttr().Get(time), mesh.GetNormalsInterpolation()
    if value is None:
        return None
    normals = np.array(value, np.float64).reshape(-1, 3)
    faces, points, face_corners = sizes
    choices: dict[str, tuple[int, Any]] = {
        "constant": (1, np.zeros_like(places)),
        "uniform": (faces, np.repeat(source[:, None], 3, axis=1)),
        "vertex": (points, corners),
        "varying": (points, corners),
        "faceVarying": (face_corners, places),
    }
    count, where_of = choices[str(interpolation)]
    where = f"{mesh.GetPath()}.{name}"
    if len(normals) != count:
        found = f"holds {len(normals)} normals, {interpolation} interpolation needs {count}"
        raise StageError(found, where=where, do="mend or remove them")
    _refuse(~np.isfinite(normals).all(1), name, normals, "they must be finite", mesh.GetPath())
    result: Float = normals[where_of]
    return result


def _subdivided(mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: Float, counts: Int, indices: Int) -> Triangles:
    where = mesh.GetPath()
    bilinear = mesh.GetSubdivisionSchemeAttr().Get() == UsdGeom.Tokens.bilinear
    boundary = str(mesh.GetInterpolateBoundaryAttr().Get(time))
    if boundary == "none" and not bilinear:
        do = "use edgeAndCorner or edgeOnly"
        raise UnsupportedError("has interpolateBoundary = none", where=where, do=do)
    if (counts == 3).any() and mesh.GetTriangleSubdivisionRuleAttr().Get(time) == UsdGeom.Tokens.smooth:
        do = "use catmullClark"
        raise UnsupportedError("has triangleSubdivisionRule = smooth", where=where, do=do)
    corners = _sharp_corners(mesh, time, len(points))
    if boundary == "edgeAndCorner":
        corners = np.maximum(corners, subdivide.lonely_corners(counts, indices, len(points)))
    cage = subdivide.cage(points, counts, indices, _creases(mesh, time, len(points)), corners)
    worn = [s[s < subdivide.INFINITE].max(initial=0) for s in (cage.edge_sharpness, cage.point_sharpness)]
    for _ in range(max(LEVELS, int(max(worn)))):
        if bilinear:
            cage = subdivide.all_sharp(cage)
        cage = subdivide.refine(cage)
    limit = cage.points if bilinear else subdivide.limit(cage)
    quads = cage.indices.reshape(-1, 4)
    normals = subdivide.corner_normals(subdivide.all_sharp(cage) if bilinear else cage, limit)
    halves = [[0, 1, 2], [0, 2, 3]]
    turned = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    return Triangles(
        points=limit,
        corners=quads[:, halves].reshape(-1, 3),
        normals=(-normals if turned else normals)[:, halves].reshape(-1, 3, 3),
        source=np.repeat(cage.source, 2),
    )


def _creases(mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: int) -> dict[tuple[int, int], float]:
    """Sharpness of point pairs (low, high)."""
    chain = _array(mesh.GetCreaseIndicesAttr(), time, np.int64)
    lengths = _array(mesh.GetCreaseLengthsAttr(), time, np.int64)
    sharpness = _array(mesh.GetCreaseSharpnessesAttr(), time, np.float64)
    where = mesh.GetPath()
    _refuse(lengths < 2, "creaseLengths", lengths, "a crease needs 2 points", where)
    _refuse((chain < 0) | (chain >= points), "creaseIndices", chain, f"there are {points} points", where)
    if len(sharpness) == len(lengths):
        sharpness = np.repeat(sharpness, lengths - 1)
    if lengths.sum() != len(chain) or len(sharpness) != len(chain) - len(lengths):
        raise StageError("its creaseLengths, creaseIndices and creaseSharpnesses disagree", where=where, do="mend them")
    last = np.cumsum(lengths) - 1
    start = np.setdiff1d(np.arange(len(chain)), last)
    pairs = np.sort(np.stack([chain[start], chain[start + 1]], 1), 1) if len(chain) else np.zeros((0, 2), int)
    values = _whole(sharpness, "creaseSharpnesses", where)
    return {(int(a), int(b)): float(v) for (a, b), v in zip(pairs, values, strict=True) if v > 0}


def _sharp_corners(mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: int) -> Float:
    """Sharpness (P,)."""
    where = mesh.GetPath()
    chosen = _array(mesh.GetCornerIndicesAttr(), time, np.int64)
    values = _whole(_array(mesh.GetCornerSharpnessesAttr(), time, np.float64), "cornerSharpnesses", where)
    if len(chosen) != len(values):
        raise StageError("its cornerIndices and cornerSharpnesses disagree", where=where, do="mend them")
    _refuse((chosen < 0) | (chosen >= points), "cornerIndices", chosen, f"there are {points} points", where)
    sharpness = np.zeros(points)
    sharpness[chosen] = values
    return sharpness


def _whole(sharpness: Float, name: str, where: Any) -> Float:
    """Whole numbers up to MAX_LEVELS, or infinitely sharp."""
    ok = (sharpness >= subdivide.INFINITE) | ((sharpness == np.round(sharpness)) & (sharpness <= MAX_LEVELS))
    if not (ok & np.isfinite(sharpness)).all():
        do = f"use whole numbers up to {MAX_LEVELS}, or {subdivide.INFINITE:g} for a sharp edge"
        raise UnsupportedError(f"has {name} such as {sharpness[~ok][:1]}", where=where, do=do)
    return np.maximum(sharpness, 0)


def _without_holes(mesh: UsdGeom.Mesh, time: Usd.TimeCode, triangles: Triangles, faces: int) -> Triangles:
    holes = _array(mesh.GetHoleIndicesAttr(), time, np.int64)
    _refuse((holes < 0) | (holes >= faces), "holeIndices", holes, f"there are {faces} faces", mesh.GetPath())
    keep = ~np.isin(triangles.source, holes)
    return Triangles(
        points=triangles.points,
        corners=triangles.corners[keep],
        normals=triangles.normals[keep],
        source=triangles.source[keep],
    )


def _turned(triangles: Triangles) -> Triangles:
    order = [0, 2, 1]
    return Triangles(
        points=triangles.points,
        corners=triangles.corners[:, order],
        normals=triangles.normals[:, order],
        source=triangles.source,
    )


def _array(attribute: Usd.Attribute, time: Usd.TimeCode, dtype: type) -> Any:
    value = attribute.Get(time)
    return np.zeros(0, dtype) if value is None else np.array(value, dtype)


def _refuse(bad: Any, name: str, values: Any, why: str, where: Any) -> None:
    if bad.any():
        i = int(np.argmax(bad))
        raise StageError(f"{name}[{i}] is {values[i]}, but {why}", where=where, do="mend the mesh")
