"""UsdGeom.PointInstancer: the prototypes and the poses of their instances."""

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError
from spin_usd.stage.composition.excess import MAX_PRIMS
from spin_usd.stage.usd.conversion import quaternions
from spin_usd.stage.usd.transforms import HALF_NORM_TOLERANCE, NORM_TOLERANCE, norm_error
from spin_usd.stage.usd.values import read


def read_instances(prim: Usd.Prim, time: Usd.TimeCode) -> list[tuple[Usd.Prim, list[Float]]]:
    """Read each prototype of an instancer, with the row-vector matrices (4, 4), prototype to instancer, of its visible
    instances; the prototype root's own transform is included.

    orientations are half precision in USD, so up to 8e-4 rad off, and used unchanged; orientationsf takes precedence.
    Raises StageError for arrays that disagree, indices out of range, or orientations whose norm is not 1.
    """
    instancer = UsdGeom.PointInstancer(prim)
    which = np.array(_value(instancer.GetProtoIndicesAttr(), time), np.int64)
    if len(which) > MAX_PRIMS:
        found = f"places {len(which)} instances, more than {MAX_PRIMS}"
        raise StageError(found, where=prim.GetPath(), do="make them fewer, or one mesh")
    prototypes = find_prototypes(prim)
    _check_arrays(instancer, time, len(which), len(prototypes), which)
    if not len(which):
        return []
    matrices = instancer.ComputeInstanceTransformsAtTime(
        time, time, UsdGeom.PointInstancer.IncludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    )
    if len(matrices) != len(which):
        raise StageError("USD cannot place its instances", where=prim.GetPath(), do="fix its arrays")
    placed = np.array(matrices).reshape(-1, 4, 4)
    mask = np.array(instancer.ComputeMaskAtTime(time) or [True] * len(which), bool)
    return [
        (prototype, list(placed[(which == number) & mask]))
        for number, prototype in enumerate(prototypes)
        if ((which == number) & mask).any()
    ]


def find_prototypes(prim: Usd.Prim) -> list[Usd.Prim]:
    """Find the prims that `prototypes` names, which may be overs, only for instancers. Raises StageError unless each is
    active and does not contain the instancer."""
    found = []
    for path in UsdGeom.PointInstancer(prim).GetPrototypesRel().GetForwardedTargets():
        prototype = prim.GetStage().GetPrimAtPath(path)
        if not prototype or not prototype.IsActive():
            raise StageError(f"its prototype {path} does not exist", where=prim.GetPath(), do="fix its prototypes")
        if prim.GetPath().HasPrefix(path):
            raise StageError(f"its prototype {path} holds the instancer", where=prim.GetPath(), do="fix its prototypes")
        found.append(prototype)
    return found


def _check_arrays(
    instancer: UsdGeom.PointInstancer, time: Usd.TimeCode, count: int, prototypes: int, which: Any
) -> None:
    where = instancer.GetPath()
    bad = (which < 0) | (which >= prototypes)
    if bad.any():
        i = int(np.argmax(bad))
        found = f"protoIndices[{i}] is {which[i]}, but there are {prototypes} prototypes"
        raise StageError(found, where=where, do="fix its arrays")
    for name in ("positions", "orientations", "orientationsf", "scales", "ids"):
        values = _value(instancer.GetPrim().GetAttribute(name), time)
        if len(values) != count and (len(values) or name == "positions"):
            raise StageError(f"has {count} protoIndices but {len(values)} {name}", where=where, do="fix its arrays")
        if name.startswith("orientations"):
            _check_norms(values, name, where)


def _check_norms(values: Any, name: str, where: Any) -> None:
    worst = norm_error(quaternions(values))
    if worst > (HALF_NORM_TOLERANCE if name == "orientations" else NORM_TOLERANCE):
        found = f"its {name} hold a quaternion whose norm is off 1 by {worst:.3g}"
        raise StageError(found, where=where, do="normalise them")


def _value(attribute: Usd.Attribute, time: Usd.TimeCode) -> Any:
    value = read(attribute, time)
    return [] if value is None else value
