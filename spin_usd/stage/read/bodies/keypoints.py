"""The target's named keypoints: a Points prim below it, with names in primvars:keypointName.

They may come from a layer of their own too, such as the one that `spin-usd keypoints` writes.
"""

from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import InputError, StageError
from spin_usd.scene.keypoints import Keypoints
from spin_usd.stage.composition.open_layer import open_layer
from spin_usd.stage.composition.open_stage import open_as_it_is, silenced
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, root_number
from spin_usd.stage.usd.values import DEFAULT_TIME, TEXTS, VECTORS, read
from spin_usd.stage.usd.visibility import PROXIES


def find_keypoints(target: Usd.Prim) -> Usd.Prim | None:
    """Find the prim that spin:target:keypoints names, else the only Points prim with keypoint names below the
    target."""
    relation = target.GetRelationship(schema.TARGET_KEYPOINTS)
    named = relation.GetTargets() if relation else []
    if named:
        prim = target.GetStage().GetPrimAtPath(named[0])
        if len(named) > 1 or not prim or not prim.IsA(UsdGeom.Points) or not named[0].HasPrefix(target.GetPath()):
            found = f"its {schema.TARGET_KEYPOINTS} does not name one Points prim below it"
            raise StageError(found, where=target.GetPath(), do="fix the relationship")
        return prim
    below = Usd.PrimRange(target, PROXIES)
    found_prims = [p for p in below if p.IsA(UsdGeom.Points) and p.HasAttribute(schema.KEYPOINT_NAME)]
    if len(found_prims) > 1:
        names = ", ".join(str(prim.GetPath()) for prim in found_prims[:5])
        do = f"name one by {schema.TARGET_KEYPOINTS}"
        raise StageError(f"has several keypoint prims ({names})", where=target.GetPath(), do=do)
    return found_prims[0] if found_prims else None


def read_keypoints(target: Usd.Prim, time: Usd.TimeCode) -> tuple[tuple[str, ...], Float]:
    """Read the names (K,) and points (K, 3), in the target prim's own axes and stage units."""
    prim = find_keypoints(target)
    if not prim:
        return (), np.zeros((0, 3))
    names, points = named_points(prim, time)
    matrix = np.array(UsdGeom.XformCache(time).ComputeRelativeTransform(prim, target)[0])
    return names, points @ matrix[:3, :3] + matrix[3, :3]


def keypoint_parts(target: Usd.Prim, count: int) -> tuple[str, ...]:
    """Read the paths of the parts to which the `count` keypoints belong; "" for none. Raises StageError for another
    number of them."""
    prim = find_keypoints(target)
    parts = read(prim.GetAttribute(schema.KEYPOINT_PARTS), DEFAULT_TIME, *TEXTS) if prim else None
    if parts is None:
        return ("",) * count
    if len(parts) != count:
        found = f"has {len(parts)} {schema.KEYPOINT_PARTS} for {count} keypoints"
        raise StageError(found, where=target.GetPath(), do="augment the stage again")
    return tuple(str(target.GetPath().AppendPath(part)) if part else "" for part in map(str, parts))


def named_points(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[tuple[str, ...], Float]:
    """Read the names (K,) and points (K, 3) of a Points prim, in its own axes and stage units. Raises StageError unless
    each point has a name of its own."""
    points = _positions(prim, time)
    names = tuple(str(name) for name in read(prim.GetAttribute(schema.KEYPOINT_NAME), time, *TEXTS) or [])
    if len(names) != len(points) or len(set(names)) != len(names):
        found = f"has {len(points)} keypoints and {len(names)} names, or names one twice"
        raise StageError(found, where=prim.GetPath(), do="give each point a name of its own")
    return names, points


def _positions(prim: Usd.Prim, time: Usd.TimeCode) -> Float:
    """Read the positions (K, 3) in the prim's own axes: in double precision where it has them, else its points.

    Raises StageError where it has both and the points are not the rounded positions: one was edited alone.
    """
    points = np.array(read(UsdGeom.Points(prim).GetPointsAttr(), time) or [], np.float32).reshape(-1, 3)
    positions = read(prim.GetAttribute(schema.KEYPOINT_POSITIONS), time, *VECTORS)
    if positions is None:
        return points.astype(np.float64)
    exact = np.array(positions, np.float64).reshape(-1, 3)
    if not np.array_equal(exact.astype(np.float32), points):
        found = f"has points that are not its {schema.KEYPOINT_POSITIONS} in single precision"
        raise StageError(found, where=prim.GetPath(), do=f"edit both alike, or remove {schema.KEYPOINT_POSITIONS}")
    return exact


def read_keypoints_layer(path: Path) -> Keypoints:
    """Read the one Points prim with keypoint names in the USD file at `path`: body axes, metres.

    Raises InputError if there is none, or several; StageError for an invalid one.
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
    """Return whether the layer at `path` contains only one Points prim, so that keypoints may replace all of it. Raises
    InputError and StageError if it cannot be opened."""
    layer = open_layer(path)
    roots = list(layer.rootPrims)
    return len(roots) == 1 and roots[0].typeName == "Points" and not (roots[0].nameChildren or layer.subLayerPaths)
