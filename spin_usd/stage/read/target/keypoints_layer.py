"""Keypoints from a layer of their own, such as the one that `spin-usd keypoints` writes."""

from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.errors import InputError
from spin_usd.scene.keypoints import Keypoints
from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.composition.open_stage import open_as_it_is, silenced
from spin_usd.stage.read.target.keypoints import named_points
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, root_number


def read_keypoints_layer(path: Path) -> Keypoints:
    """Read the one Points prim with keypoint names in the USD file at `path`: body axes, metres.

    Raises InputError where there is none, or several; StageError for one that is not sound.
    """
    with silenced():
        stage = open_as_it_is(path)
    found = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Points) and prim.HasAttribute(schema.KEYPOINT_NAME)]
    if len(found) != 1:
        what = f"has {len(found)} Points prims with {schema.KEYPOINT_NAME}"
        raise InputError(what, where=path, do="give a file with one, such as spin-usd keypoints writes")
    time = Usd.TimeCode.EarliestTime()
    names, points = named_points(found[0], time)
    matrix = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(found[0]))  # for row vectors
    metres = root_number(stage, METRES_PER_UNIT)
    return Keypoints(names=names, points=(points @ matrix[:3, :3] + matrix[3, :3]) * metres)


def holds_keypoints_alone(path: Path) -> bool:
    """Return whether the layer at `path` holds nothing but one Points prim, so that keypoints may replace all of it.
    Raises InputError and StageError for what cannot be opened."""
    layer = open_layer(path)
    roots = list(layer.rootPrims)
    return len(roots) == 1 and roots[0].typeName == "Points" and not (roots[0].nameChildren or layer.subLayerPaths)
