"""A UsdGeom.Mesh with a subdivision scheme, as the schema describes it: creases, corners, boundaries."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage import subdivide
from spin_usd.stage.attributes import array, refuse
from spin_usd.stage.primvars import FoundPrimvar
from spin_usd.stage.subdivided_primvars import rider
from spin_usd.stage.triangles import Int, Triangles

LEVELS = 2  # 16 quadrangles for one; their corners lie on the limit surface
MAX_LEVELS = 4


def subdivided(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: Float, counts: Int, indices: Int, primvars: Sequence[FoundPrimvar]
) -> Triangles:
    """Triangles of a checked mesh with `primvars` at their corners; `source` is the authored face.

    catmullClark: refined LEVELS times, more where a crease lasts longer, then moved to the limit surface. bilinear: the
    same refinement with everything sharp. Authored normals do not count (as in USD). Raises UnsupportedError for
    fractional creases, open boundaries (interpolateBoundary = none) and triangleSubdivisionRule = smooth.
    """
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
    mode = str(mesh.GetFaceVaryingLinearInterpolationAttr().Get(time))
    riders = [rider(primvar, cage, mode, bilinear=bilinear) for primvar in primvars]
    worn = [s[s < subdivide.INFINITE].max(initial=0) for s in (cage.edge_sharpness, cage.point_sharpness)]
    for _ in range(max(LEVELS, int(max(worn)))):
        if bilinear:
            cage = subdivide.all_sharp(cage)
        cage = subdivide.refine(cage)
        riders = [each.refined() for each in riders]
    limit = cage.points if bilinear else subdivide.limit(cage)
    quads = cage.indices.reshape(-1, 4)
    normals = subdivide.corner_normals(subdivide.all_sharp(cage) if bilinear else cage, limit)
    turned = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    return Triangles(
        points=limit,
        corners=_halved(quads),
        normals=_halved(-normals if turned else normals),
        source=np.repeat(cage.source, 2),
        primvars={each.name: _halved(each.corners()) for each in riders},
    )


def _halved(quads: Any) -> Any:
    """(2 F, 3, ...) of (F, 4, ...): each quadrangle as two triangles."""
    halves = quads[:, [[0, 1, 2], [0, 2, 3]]]
    return halves.reshape(-1, 3, *quads.shape[2:])


def _creases(mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: int) -> dict[tuple[int, int], float]:
    """Sharpness of point pairs (low, high)."""
    chain = array(mesh.GetCreaseIndicesAttr(), time, np.int64)
    lengths = array(mesh.GetCreaseLengthsAttr(), time, np.int64)
    sharpness = array(mesh.GetCreaseSharpnessesAttr(), time, np.float64)
    where = mesh.GetPath()
    refuse(lengths < 2, "creaseLengths", lengths, "a crease needs 2 points", where)
    refuse((chain < 0) | (chain >= points), "creaseIndices", chain, f"there are {points} points", where)
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
    chosen = array(mesh.GetCornerIndicesAttr(), time, np.int64)
    values = _whole(array(mesh.GetCornerSharpnessesAttr(), time, np.float64), "cornerSharpnesses", where)
    if len(chosen) != len(values):
        raise StageError("its cornerIndices and cornerSharpnesses disagree", where=where, do="mend them")
    refuse((chosen < 0) | (chosen >= points), "cornerIndices", chosen, f"there are {points} points", where)
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
