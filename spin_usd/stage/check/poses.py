"""Rules on poses and their times: rigid motions as precise as pictures can show, at the time codes of the frames."""

from collections.abc import Iterator

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.check.cameras import render_camera
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import root_number
from spin_usd.stage.usd.transforms import NORM_TOLERANCE, op_types, orient_norm_error
from spin_usd.stage.usd.values import read

ROUNDED_NORM = 1e-9  # of a quaternion printed with ten decimals: no label can show such a rotation
SEEN_RAD = 1e-6  # 0.003 px of SPEED+'s camera


def capture_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """The stage's time codes match the frames that the default prim names."""
    prim = stage.GetDefaultPrim()
    attribute = prim.GetAttribute(schema.CAPTURE_FRAME) if prim else Usd.Attribute()
    times = attribute.GetTimeSamples() if attribute else []
    start, end = root_number(stage, "startTimeCode"), root_number(stage, "endTimeCode")
    if times and (start, end) != (times[0], times[-1]):
        yield Finding(
            code="capture-range",
            where=str(prim.GetPath()),
            message=f"the stage runs from {start:g} to {end:g}, its pictures from {times[0]:g} to {times[-1]:g}, so "
            "other programs play other times; make them equal",
            severity=WARNING,
        )


def pose_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """The target's time samples are rigid motions, as precise as pictures can show."""
    camera = render_camera(stage)
    for target in stage.Traverse():
        if target.HasAPI(schema.TARGET_API):
            for op in UsdGeom.Xformable(target).GetOrderedXformOps():
                yield from _op_findings(op, target, camera)


def norm_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """The quaternions of target and cameras have norm 1. The reader refuses larger errors; small ones are reported
    here."""
    for prim in stage.Traverse():
        if not (prim.HasAPI(schema.TARGET_API) or prim.IsA(UsdGeom.Camera)):
            continue
        for op in UsdGeom.Xformable(prim).GetOrderedXformOps():
            off = orient_norm_error(op) if op.GetTypeName() == Sdf.ValueTypeNames.Quatd else 0.0
            if ROUNDED_NORM < off <= NORM_TOLERANCE:
                message = (
                    f"{op.GetOpName()} holds a quaternion whose norm is off 1 by {off:.2g}: USD reads it as a rotation "
                    f"that is up to {2 * off:.2g} rad off: normalise it"
                )
                yield Finding(code="pose-norm", where=str(prim.GetPath()), message=message, severity=WARNING)


def _op_findings(op: UsdGeom.XformOp, target: Usd.Prim, camera: Usd.Prim | None) -> Iterator[Finding]:
    where, count = str(target.GetPath()), op.GetNumTimeSamples()
    name, kind = op.GetName(), op.GetTypeName()
    if kind == Sdf.ValueTypeNames.Matrix4d and count > 1:
        message = f"{name} has {count} matrices, which shear between time samples: use translate and orient"
        yield Finding(code="pose-matrix", where=where, message=message, severity=WARNING)
    if _rounds(op, target, camera):
        message = f"{name} is {kind}, which rounds the pose: use double3 and quatd"
        yield Finding(code="pose-precision", where=where, message=message, severity=WARNING)


def _rounds(op: UsdGeom.XformOp, target: Usd.Prim, camera: Usd.Prim | None) -> bool:
    """Return whether the operation's type rounds poses by more than a picture could show. Single precision rounds
    rotations by 1e-7 rad, and matters only for translations much longer than the distance from the camera."""
    if op.GetPrecision() != UsdGeom.XformOp.PrecisionFloat:
        return bool(op.GetPrecision() == UsdGeom.XformOp.PrecisionHalf)
    if op.GetOpType() != UsdGeom.XformOp.TypeTranslate or not camera:
        return False
    for time in [Usd.TimeCode(t) for t in op.GetTimeSamples()] or [Usd.TimeCode.Default()]:
        step = np.spacing(np.abs(np.array(read(op.GetAttr(), time, *op_types(op)), np.float32)).max())
        world = UsdGeom.XformCache(time)
        here, there = (world.GetLocalToWorldTransform(prim).ExtractTranslation() for prim in (camera, target))
        if step > SEEN_RAD * (there - here).GetLength():
            return True
    return False
