"""The size of a target: the corners of its rendered geometry's hull, and of the box around it."""

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.arrays import Float
from spin_usd.errors import GeometryError, StageError, UnsupportedError
from spin_usd.stage.author.target_asset import TargetAsset
from spin_usd.stage.composition.images import Images
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.read.target.body_parts import BodyParts
from spin_usd.stage.read.target.target import TargetReader
from spin_usd.stage.usd.notes import Notes
from spin_usd.stage.usd.visibility import RENDERED_PURPOSES


def hull_corners(target: TargetAsset) -> Float:
    """Compute the corners (N, 3) of the target's convex hull: metres, in its own axes. Those of the box around a target
    that a render will refuse."""
    try:
        return _hull(target)
    except (StageError, UnsupportedError, GeometryError):
        return box_corners(target)


def _hull(target: TargetAsset) -> Float:
    stage, time = open_as_it_is(target.file), Usd.TimeCode.EarliestTime()
    root = _root(stage, target)
    reader = TargetReader(
        prim=root,
        parts=BodyParts().add(root),
        time=time,
        group_of=lambda _: 0,
        images=Images(check=False),
        notes=Notes(),
    )
    own = reader.read(1.0).mesh.hull
    placed = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(root))  # for row vectors
    corners: Float = (own @ placed[:3, :3] + placed[3, :3]) * target.metres_per_unit
    return corners


def box_corners(target: TargetAsset) -> Float:
    """Compute the corners (8, 3) of the target's bounding box: metres, in its own axes. Where USD finds none, as of a
    SkelRoot without an extent, those of its hull."""
    stage = open_as_it_is(target.file)
    cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), list(RENDERED_PURPOSES))
    box = cache.ComputeWorldBound(_root(stage, target)).ComputeAlignedRange()
    corners = np.array([box.GetCorner(i) for i in range(8)], np.float64) * target.metres_per_unit
    if np.ptp(corners, axis=0).any():
        return corners
    try:
        return _hull(target)
    except (StageError, UnsupportedError, GeometryError):
        return corners


def _root(stage: Usd.Stage, target: TargetAsset) -> Usd.Prim:
    return stage.GetPrimAtPath(target.prim) if target.prim else stage.GetDefaultPrim()
