"""Find the prims that are geometry that a render shows."""

from pxr import Usd, UsdGeom, UsdLod, UsdLux, UsdSkel

from spin_usd.errors import UnsupportedError
from spin_usd.stage.read.shapes.primitives import SHAPES


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
