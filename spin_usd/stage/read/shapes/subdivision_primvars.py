"""Primvars of a subdivided mesh: cages of values that are refined in step with the cage of points.

Source: the rules of OpenSubdiv's documentation ("Face-varying interpolation rules"), to which the schema of
UsdGeomMesh refers for faceVaryingLinearInterpolation. An edge is continuous where both of its ends have the same
values on both sides; all other edges bound the values like the border of a mesh.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.errors import UnsupportedError
from spin_usd.stage.read.shapes.cage import INFINITE, Cage, Scheme, all_sharp, cage
from spin_usd.stage.read.shapes.primvars import FoundPrimvar, check_count
from spin_usd.stage.read.shapes.triangles import Int

MODES = ("none", "cornersOnly", "cornersPlus1", "cornersPlus2", "boundaries", "all")


@dataclass(frozen=True, kw_only=True, eq=False)
class PrimvarCage:
    """Values of one primvar on a cage; `linear`: interpolated between the first cage's corners only."""

    name: str
    cage: Cage
    scheme: Scheme
    linear: bool

    def refined(self) -> "PrimvarCage":
        """Refine the cage once."""
        return replace(self, cage=self.scheme.refine(all_sharp(self.cage) if self.linear else self.cage))

    def corners(self) -> Float:
        """Return the values (F, n, C) of a refined cage on the limit surface."""
        return self.cage.at_corners(self.cage.points if self.linear else self.scheme.limit(self.cage))


def primvar_cage(primvar: FoundPrimvar, points: Cage, mode: str, scheme: Scheme, *, bilinear: bool) -> PrimvarCage:
    """Build the cage of a primvar's values beside that of the points. Raises StageError for a wrong count of values,
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
    becomes one point for each different value there."""
    pairs, indices = np.unique(np.stack([points.indices, number], 1), axis=0, return_inverse=True)
    vertex = pairs[:, 0]
    own = cage(values[pairs[:, 1]], points.counts, indices.reshape(-1), {}, points.point_sharpness[vertex])
    sharpness = own.edge_sharpness.copy()
    np.maximum.at(sharpness, own.face_edges, points.edge_sharpness[points.face_edges])
    own = replace(own, edge_sharpness=sharpness)
    sharp = _sharpened(own, vertex, _at(points, points.edge_faces != 2)[vertex], mode)
    return replace(own, point_sharpness=np.where(sharp, INFINITE, own.point_sharpness))


def _sharpened(c: Cage, vertex: Int, border: NDArray[np.bool_], mode: str) -> NDArray[np.bool_]:
    """Return which values (V,) the mode fixes. vertex (V,): the point of each · border (V,): whether it is on the
    mesh's boundary."""
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
