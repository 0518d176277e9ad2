"""The size of a target: the corners of the box around its rendered geometry."""

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.stage.author.target.target_asset import TargetAsset
from spin_usd.stage.usd.visibility import RENDERED_PURPOSES


def box_corners(target: TargetAsset) -> Float:
    """Compute the corners (8, 3) of the target's bounding box: metres, in its own axes."""
    stage = Usd.Stage.Open(str(target.file))
    root = stage.GetPrimAtPath(target.prim) if target.prim else stage.GetDefaultPrim()
    bounds = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), list(RENDERED_PURPOSES)).ComputeWorldBound(root)
    box = bounds.ComputeAlignedRange()
    return np.array([box.GetCorner(i) for i in range(8)], np.float64) * target.metres_per_unit
