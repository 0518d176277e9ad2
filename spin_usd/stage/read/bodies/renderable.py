"""Find the prims that are geometry that a render shows."""

from collections.abc import Callable, Iterator
from typing import TypeVar

from pxr import Usd, UsdGeom, UsdLod, UsdLux, UsdSkel

from spin_usd.errors import UnsupportedError
from spin_usd.stage.read.shapes.primitives import SHAPES
from spin_usd.stage.usd.prim_order import ordered_children
from spin_usd.stage.usd.root_metadata import Notes

State = TypeVar("State")
THIN = ("BasisCurves", "HermiteCurves", "NurbsCurves", "Points")
"""Kinds of gprim without a surface."""


def is_left_out(prim: Usd.Prim, notes: Notes) -> bool:
    """Return whether `prim` is of curves or points, and note that they are left out of labels and pictures."""
    if str(prim.GetTypeName()) not in THIN:
        return False
    notes.add("geometry-thin", prim.GetPath(), f"is a {prim.GetTypeName()}, which is rendered in no picture")
    return True


def is_geometry(prim: Usd.Prim) -> bool:
    """Return whether `prim` is geometry. Raises UnsupportedError for kinds that this version does not read."""
    if prim.HasAPI(UsdLod.RootAPI):
        raise UnsupportedError("chooses among levels of detail", where=prim.GetPath(), do="keep one of them")
    if prim.IsA(UsdGeom.Mesh) or prim.IsA(UsdGeom.PointInstancer) or str(prim.GetTypeName()) in SHAPES:
        return True
    other = prim.IsA(UsdGeom.Boundable) and not prim.HasAPI(UsdLux.LightAPI)
    if other and not prim.IsA(UsdSkel.Root) and not prim.IsA(UsdSkel.Skeleton):
        do = "convert it to a Mesh, make it invisible, or give it purpose guide"
        raise UnsupportedError(f"is a {prim.GetTypeName()}, which is not rendered yet", where=prim.GetPath(), do=do)
    return False


def geometry_below(
    root: Usd.Prim, state: State, *, enter: Callable[[Usd.Prim, State], State], shown: Callable[[Usd.Prim], bool]
) -> Iterator[tuple[Usd.Prim, State]]:
    """Yield `root`, which has `state`, and all prims below it that are `shown`, each with the state that it inherits:
    `enter` gives a child's from its parent's. Subsets, and prims below point instancers, are left out."""
    waiting = [(root, state)]
    while waiting:
        prim, own = waiting.pop()
        yield prim, own
        if not prim.IsA(UsdGeom.PointInstancer):
            children = (child for child in reversed(ordered_children(prim)) if not child.IsA(UsdGeom.Subset))
            waiting += [(child, enter(child, own)) for child in children if shown(child)]
