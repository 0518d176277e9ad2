"""UsdGeom.Mesh as triangles: any face size, with or without subdivision; its arrays are checked first."""

from collections.abc import Sequence

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.deformation import Deformation
from spin_usd.stage.read.shapes.primvars import Corners, FoundPrimvar, known_interpolation
from spin_usd.stage.read.shapes.subdivision import SCHEMES, subdivided
from spin_usd.stage.read.shapes.triangles import Int, Triangles, face_normals, unit
from spin_usd.stage.read.shapes.triangulate import triangulate
from spin_usd.stage.usd.values import VECTORS, array, read, refuse


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
        found = f"faceVertexCounts ask for {counts.sum()} indices, faceVertexIndices holds {len(indices)}"
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
    positions, source = triangulate(points, counts, indices, mesh.GetPath())
    corners = indices[positions]
    at = Corners(positions=positions, points=corners, faces=source, counts=(len(indices), len(points), len(counts)))
    flat = np.repeat(face_normals(points, corners)[:, None], 3, axis=1)
    if read(mesh.GetOrientationAttr()) == UsdGeom.Tokens.leftHanded:
        flat = -flat
    normals = _authored_normals(mesh, time, at)
    if normals is not None:
        own = deformation.normals(normals, corners, len(points)) if deformation else unit(normals)
        flat = np.where((normals != 0).any(-1, keepdims=True), own, flat)
    return Triangles(
        points=points,
        corners=corners,
        normals=flat,
        source=source,
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
