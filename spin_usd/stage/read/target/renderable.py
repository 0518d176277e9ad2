"""Find the prims that are geometry that a render shows, and refuse such geometry outside the target."""

from collections.abc import Iterator

from pxr import Usd, UsdGeom, UsdLod, UsdLux, UsdSkel

from spin_usd.errors import UnsupportedError
from spin_usd.stage.read.shapes.primitives import SHAPES
from spin_usd.stage.usd.visibility import PROXIES, RENDERED_PURPOSES, is_always_invisible, own_purpose


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


def refuse_geometry_outside(target: Usd.Prim) -> None:
    """Raise UnsupportedError for geometry that would be rendered, at any time, outside the target."""
    for error in geometry_outside(target):
        raise error


def geometry_outside(target: Usd.Prim) -> Iterator[UnsupportedError]:
    """Yield an error for each prim that would be rendered, at any time, outside the target."""
    waiting = [(prim, "default") for prim in target.GetStage().GetPseudoRoot().GetFilteredChildren(PROXIES)]
    while waiting:
        prim, inherited = waiting.pop()
        if prim == target or is_always_invisible(prim):
            continue
        purpose = own_purpose(prim, inherited)
        if purpose in RENDERED_PURPOSES and (error := _outside(prim, target)):
            yield error
        waiting += [(child, purpose) for child in prim.GetFilteredChildren(PROXIES)]


def _outside(prim: Usd.Prim, target: Usd.Prim) -> UnsupportedError | None:
    """Return an error for `prim`, which is outside the target; None where it is not geometry."""
    try:
        if not is_geometry(prim):
            return None
    except UnsupportedError as error:
        return error
    found = f"lies outside the target {target.GetPath()}, and only the target is rendered yet"
    do = "move it below the target, make it invisible, or give it purpose guide"
    return UnsupportedError(found, where=prim.GetPath(), do=do)
