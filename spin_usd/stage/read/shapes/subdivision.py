"""A UsdGeom.Mesh with a subdivision scheme, as the schema describes it: creases, corners, boundaries."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError, UnsupportedError
from spin_usd.stage.read.shapes.cage import INFINITE, Cage, Scheme, all_sharp, cage, corner_normals, lonely_corners
from spin_usd.stage.read.shapes.catmull_clark import CATMULL_CLARK
from spin_usd.stage.read.shapes.loop import LOOP
from spin_usd.stage.read.shapes.primvars import FoundPrimvar, check_count
from spin_usd.stage.read.shapes.triangles import Int, Triangles
from spin_usd.stage.usd.root_metadata import Notes
from spin_usd.stage.usd.values import array, read, refuse

LEVELS = 2  # 16 quadrangles or triangles per face; their corners lie on the limit surface
MAX_LEVELS = 4
SCHEMES = {"catmullClark": CATMULL_CLARK, "bilinear": CATMULL_CLARK, "loop": LOOP}
"""The schemes of USD's subdivision schemes; bilinear is catmullClark with everything sharp."""

MODES = ("none", "cornersOnly", "cornersPlus1", "cornersPlus2", "boundaries", "all")


def subdivided(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: Float, counts: Int, indices: Int, primvars: Sequence[FoundPrimvar]
) -> Triangles:
    """Subdivide a checked mesh to triangles with `primvars` at their corners; `source` is the authored face.

    catmullClark, loop: refined LEVELS times, more where a crease lasts longer, then moved to the limit surface.
    bilinear: the same refinement with everything sharp. Authored normals do not count (as in USD). Raises
    UnsupportedError for fractional creases, open boundaries (interpolateBoundary = none), triangleSubdivisionRule =
    smooth, and loop on faces that are not triangles.
    """
    name = str(read(mesh.GetSubdivisionSchemeAttr()))
    scheme, bilinear = SCHEMES[name], name == "bilinear"
    _check_scheme(mesh, time, name, counts)
    corners = _sharp_corners(mesh, time, len(points))
    if read(mesh.GetInterpolateBoundaryAttr(), time) == UsdGeom.Tokens.edgeAndCorner:
        corners = np.maximum(corners, lonely_corners(counts, indices, len(points)))
    c = cage(points, counts, indices, _creases(mesh, time, len(points)), corners)
    mode = str(read(mesh.GetFaceVaryingLinearInterpolationAttr(), time))
    cages = [primvar_cage(primvar, c, mode, scheme, bilinear=bilinear) for primvar in primvars]
    sharpest = [s[s < INFINITE].max(initial=0) for s in (c.edge_sharpness, c.point_sharpness)]
    for _ in range(max(LEVELS, int(max(sharpest)))):
        c = scheme.refine(all_sharp(c) if bilinear else c)
        cages = [each.refined() for each in cages]
    limit = c.points if bilinear else scheme.limit(c)
    normals = corner_normals(all_sharp(c) if bilinear else c, limit)
    left_handed = read(mesh.GetOrientationAttr()) == UsdGeom.Tokens.leftHanded
    return Triangles(
        points=limit,
        corners=_cut(c.indices.reshape(-1, scheme.corners)),
        normals=_cut(-normals if left_handed else normals),
        source=np.repeat(c.source, scheme.corners - 2),
        primvars={each.name: _cut(each.corners()) for each in cages},
    )


def note_creases(mesh: UsdGeom.Mesh, time: Usd.TimeCode, notes: Notes) -> None:
    """Note creases and corners that last for more steps than are made, and count as sharp."""
    if str(read(mesh.GetSubdivisionSchemeAttr())) in SCHEMES:
        for attribute in (mesh.GetCreaseSharpnessesAttr(), mesh.GetCornerSharpnessesAttr()):
            values = array(attribute, time, np.float64)
            if ((values > MAX_LEVELS) & (values < INFINITE)).any():
                found = f"is above {MAX_LEVELS}, and rendered as sharp: off by less than 1 % of the faces' edges"
                notes.add("crease-sharp", attribute.GetPath(), found)


def _check_scheme(mesh: UsdGeom.Mesh, time: Usd.TimeCode, scheme: str, counts: Int) -> None:
    where = mesh.GetPath()
    if read(mesh.GetInterpolateBoundaryAttr(), time) == UsdGeom.Tokens.none and scheme != "bilinear":
        do = "use edgeAndCorner or edgeOnly"
        raise UnsupportedError("has interpolateBoundary = none", where=where, do=do)
    if scheme == "loop" and (counts != 3).any():
        found = f"has subdivision scheme loop and a face of {counts[counts != 3][0]} corners"
        raise UnsupportedError(found, where=where, do="triangulate it")
    smooth = read(mesh.GetTriangleSubdivisionRuleAttr(), time) == UsdGeom.Tokens.smooth  # as loop does anyway
    if scheme != "loop" and smooth and (counts == 3).any():
        do = "use catmullClark"
        raise UnsupportedError("has triangleSubdivisionRule = smooth", where=where, do=do)


def _cut(faces: Any) -> Any:
    """Cut quadrangles (F, 4, ...) into triangles (2 F, 3, ...); triangles (F, 3, ...) stay unchanged."""
    if faces.shape[1] == 3:
        return faces
    halves = faces[:, [[0, 1, 2], [0, 2, 3]]]
    return halves.reshape(-1, 3, *faces.shape[2:])


def _creases(mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: int) -> dict[tuple[int, int], float]:
    """Read the sharpness of point pairs (low, high)."""
    chain = array(mesh.GetCreaseIndicesAttr(), time, np.int64)
    lengths = array(mesh.GetCreaseLengthsAttr(), time, np.int64)
    sharpness = array(mesh.GetCreaseSharpnessesAttr(), time, np.float64)
    where = mesh.GetPath()
    refuse(lengths < 2, "creaseLengths", lengths, "a crease needs 2 points", where)
    refuse((chain < 0) | (chain >= points), "creaseIndices", chain, f"there are {points} points", where)
    if len(sharpness) == len(lengths):
        sharpness = np.repeat(sharpness, lengths - 1)
    if lengths.sum() != len(chain) or len(sharpness) != len(chain) - len(lengths):
        raise StageError("its creaseLengths, creaseIndices and creaseSharpnesses disagree", where=where, do="fix them")
    last = np.cumsum(lengths) - 1
    start = np.setdiff1d(np.arange(len(chain)), last)
    pairs = np.sort(np.stack([chain[start], chain[start + 1]], 1), 1) if len(chain) else np.zeros((0, 2), int)
    values = _whole(sharpness, "creaseSharpnesses", where)
    return {(int(a), int(b)): float(v) for (a, b), v in zip(pairs, values, strict=True) if v > 0}


def _sharp_corners(mesh: UsdGeom.Mesh, time: Usd.TimeCode, points: int) -> Float:
    """Read the sharpness (P,) of points."""
    where = mesh.GetPath()
    chosen = array(mesh.GetCornerIndicesAttr(), time, np.int64)
    values = _whole(array(mesh.GetCornerSharpnessesAttr(), time, np.float64), "cornerSharpnesses", where)
    if len(chosen) != len(values):
        raise StageError("its cornerIndices and cornerSharpnesses disagree", where=where, do="fix them")
    refuse((chosen < 0) | (chosen >= points), "cornerIndices", chosen, f"there are {points} points", where)
    sharpness = np.zeros(points)
    sharpness[chosen] = values
    return sharpness


def _whole(sharpness: Float, name: str, where: Any) -> Float:
    """Return `sharpness`, not negative, infinite above MAX_LEVELS. Raises UnsupportedError for fractions below."""
    lasting = sharpness > MAX_LEVELS
    ok = lasting | (sharpness == np.round(sharpness))
    if not ok.all():
        do = f"use whole numbers up to {MAX_LEVELS}, or {INFINITE:g} for a sharp edge"
        raise UnsupportedError(f"has {name} such as {sharpness[~ok][:1]}", where=where, do=do)
    return np.where(lasting, INFINITE, np.maximum(sharpness, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class PrimvarCage:
    """Values of one primvar on a cage, which is refined in step with the cage of points."""

    name: str
    cage: Cage
    scheme: Scheme
    linear: bool
    """Whether they are interpolated between the first cage's corners only."""

    def refined(self) -> "PrimvarCage":
        """Refine the cage once."""
        return replace(self, cage=self.scheme.refine(all_sharp(self.cage) if self.linear else self.cage))

    def corners(self) -> Float:
        """Return the values (F, n, C) of a refined cage on the limit surface."""
        return self.cage.at_corners(self.cage.points if self.linear else self.scheme.limit(self.cage))


def primvar_cage(primvar: FoundPrimvar, points: Cage, mode: str, scheme: Scheme, *, bilinear: bool) -> PrimvarCage:
    """Build the cage of a primvar's values beside the points' cage. Raises StageError for a wrong count of values,
    UnsupportedError for a mode that USD does not have."""
    if mode not in MODES:
        found = f"has faceVaryingLinearInterpolation = {mode}"
        raise UnsupportedError(found, where=primvar.where, do=f"use one of {', '.join(MODES)}")
    kind, count = primvar.interpolation, len(primvar.indices)
    needed = {"constant": 1, "uniform": len(points.counts), "faceVarying": len(points.indices)}
    check_count(kind, count, needed.get(kind, len(points.points)), primvar.where)
    if kind in ("vertex", "varying"):
        own = replace(points, points=primvar.elements)
    else:
        corners = {"constant": np.zeros(len(points.indices), int), "uniform": points.face_of_corner}
        element = corners.get(kind, np.arange(len(points.indices)))
        own = _face_varying(points, primvar.indices[element], primvar.values, mode)
    linear = bilinear or kind in ("varying", "constant", "uniform") or (kind == "faceVarying" and mode == "all")
    return PrimvarCage(name=primvar.name, cage=own, scheme=scheme, linear=linear)


def _face_varying(points: Cage, number: Int, values: Float, mode: str) -> Cage:
    """Build the cage of face-varying values. number (sum of counts,): of the value at each corner. A point of the mesh
    becomes one point for each different value there.

    An edge is continuous where both of its ends have the same values on both sides; all other edges bound the values
    like the border of a mesh.
    """
    pairs, indices = np.unique(np.stack([points.indices, number], 1), axis=0, return_inverse=True)
    vertex = pairs[:, 0]
    own = cage(values[pairs[:, 1]], points.counts, indices.reshape(-1), {}, points.point_sharpness[vertex])
    sharpness = own.edge_sharpness.copy()
    np.maximum.at(sharpness, own.face_edges, points.edge_sharpness[points.face_edges])
    own = replace(own, edge_sharpness=sharpness)
    sharp = _sharpened(own, vertex, _at(points, points.edge_faces != 2)[vertex], mode)
    return replace(own, point_sharpness=np.where(sharp, INFINITE, own.point_sharpness))


def _sharpened(c: Cage, vertex: Int, border: NDArray[np.bool_], mode: str) -> NDArray[np.bool_]:
    """Return which values (V,) the mode fixes.

    Source: the rules of OpenSubdiv's documentation ("Face-varying interpolation rules"), to which the schema of
    UsdGeomMesh refers for faceVaryingLinearInterpolation.

    Args:
        vertex: (V,): the point of each.
        border: (V,): whether it is on the mesh's boundary.
    """
    faces = np.bincount(c.indices, minlength=len(c.points))
    bounded = _at(c, c.edge_faces != 2)
    if mode == "boundaries":
        return bounded
    sharp = (faces == 1) & (mode not in ("none", "all"))
    if mode in ("cornersPlus1", "cornersPlus2"):
        meeting = np.bincount(vertex)[vertex]
        creased = _at(c, (c.edge_faces == 2) & (c.edge_sharpness >= INFINITE))
        sharp |= (meeting > 2) | ((meeting == 2) & _any(creased, vertex))
    if mode == "cornersPlus2":
        sharp |= ((meeting == 2) & _any(faces == 1, vertex)) | ((meeting == 1) & bounded & ~border)
    return np.asarray(sharp)


def _at(c: Cage, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask (P,) of the points at the ends of chosen edges (E,)."""
    return np.bincount(c.edges[chosen].reshape(-1), minlength=len(c.points)) > 0


def _any(chosen: NDArray[np.bool_], vertex: Int) -> NDArray[np.bool_]:
    """Return for each value whether any value at the same point is chosen."""
    return np.bincount(vertex, chosen)[vertex] > 0
