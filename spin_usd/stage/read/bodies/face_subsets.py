"""The subsets of a gprim's faces: which triangles each holds, and which of them gives a triangle its material."""

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.errors import StageError
from spin_usd.stage.read.bodies.part_labels import Labels
from spin_usd.stage.read.shapes.triangles import Int, Triangles
from spin_usd.stage.usd.prim_order import in_order
from spin_usd.stage.usd.values import read


def find_subsets(prim: Usd.Prim) -> list[UsdGeom.Subset]:
    """Find all subsets of the gprim, of any family."""
    subsets = UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(prim))
    return [UsdGeom.Subset(each) for each in in_order(subset.GetPrim() for subset in subsets)]


def named_subsets(prim: Usd.Prim, labels: Labels) -> list[tuple[UsdGeom.Subset, Labels]]:
    """Find the subsets that are parts of their own on a gprim of `labels`, with theirs."""
    below = ((subset, labels.below(subset.GetPrim())) for subset in find_subsets(prim))
    return [(subset, own) for subset, own in below if own.part_key != labels.part_key]


def binds_material(subset: UsdGeom.Subset) -> bool:
    """Return whether the subset's faces may have a material of their own."""
    return bool(read(subset.GetFamilyNameAttr()) == "materialBind")


def triangles_in(subset: UsdGeom.Subset, triangles: Triangles, prim: Usd.Prim, time: Usd.TimeCode) -> Any:
    """Return the mask (T,) of the `triangles` of the gprim `prim` in a subset of faces."""
    if read(subset.GetElementTypeAttr()) != UsdGeom.Tokens.face:
        return np.zeros(len(triangles.source), bool)
    indices = np.array(read(subset.GetIndicesAttr(), time) or [], np.int64)
    counts = read(UsdGeom.Mesh(prim).GetFaceVertexCountsAttr(), time) if prim.IsA(UsdGeom.Mesh) else [0]
    bad = (indices < 0) | (indices >= len(counts))
    if bad.any():
        found = f"indices[{int(np.argmax(bad))}] is {indices[np.argmax(bad)]}, but there are {len(counts)} faces"
        raise StageError(found, where=subset.GetPath(), do="fix the subset")
    return np.isin(triangles.source, indices)


def painter_of(subsets: list[UsdGeom.Subset], triangles: Triangles, prim: Usd.Prim, time: Usd.TimeCode) -> Int:
    """Return for each triangle (T,) the number, from 1, of the subset that gives it a material; 0 for the prim's
    own."""
    of = np.zeros(len(triangles.source), np.int64)
    for number, subset in enumerate(subsets, 1):
        chosen = triangles_in(subset, triangles, prim, time)
        if of[chosen].any():
            found = "shares faces with another subset of family materialBind"
            raise StageError(found, where=subset.GetPath(), do="give each face one material")
        of[chosen] = number
    return of
