"""Models that other programs show by a stand-in: UsdGeomModelAPI's draw modes, which our renderers ignore."""

from collections.abc import Iterator

from pxr import Usd, UsdGeom

from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import PROXIES

GEOMETRY = ("default", "inherited")


def stand_ins(root: Usd.Prim) -> Iterator[tuple[Usd.Prim, str]]:
    """Yield each topmost model at or below `root` that other programs show by a stand-in, and its draw mode: bounds,
    cards or origin.

    A component's draw mode applies; another model's only where model:applyDrawMode is set.
    """
    prims = iter(Usd.PrimRange(root, PROXIES))
    for prim in prims:
        model = UsdGeom.ModelAPI(prim)
        applied = prim.IsModel() and (prim.IsComponent() or read(model.GetModelApplyDrawModeAttr()))
        mode = str(model.ComputeModelDrawMode()) if applied else GEOMETRY[0]
        if mode not in GEOMETRY:
            prims.PruneChildren()
            yield prim, mode
