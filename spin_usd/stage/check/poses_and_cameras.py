"""Rules on what makes the pictures: their times, the target's poses, the camera and what is derived from its lens."""

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from spin_usd.errors import SpinError
from spin_usd.geometry.camera import Camera
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.read.camera.camera import find_camera, read_camera
from spin_usd.stage.read.camera.lens import derived_values, read_lens
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.root_metadata import root_number
from spin_usd.stage.usd.transforms import NORM_TOLERANCE, orient_norm_error

ROUNDED_NORM = 1e-9  # of a quaternion printed with ten decimals: what it turns no label can show
SEEN_RAD = 1e-6  # 0.003 px of SPEED+'s camera
LENS = "spin:lens:"
FLOAT32_STEP = 1e-6  # relative: derived values are rounded to float32


def capture_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """The stage's time codes are those of the pictures that the default prim names."""
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
    """The target's time samples are rigid motions, as precise as the pictures show them."""
    camera = _taken(stage)
    for target in stage.Traverse():
        if target.HasAPI(schema.TARGET_API):
            for op in UsdGeom.Xformable(target).GetOrderedXformOps():
                yield from _op_findings(op, target, camera)


def norm_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """The quaternions of target and cameras have length 1: others are refused where they are far off, told here."""
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


def camera_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Every camera has a size in pixels; from our lens USD's own attributes and omni:lensdistortion:* follow."""
    for prim in (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)):
        where = str(prim.GetPath())
        if not prim.HasAPI(schema.LENS_API):
            yield from _unsized(prim)
            continue
        try:
            camera = read_lens(prim)
            camera.check_invertible()
        except SpinError as error:
            if prim != _taken(stage):  # what is wrong with that one, its pictures tell
                yield Finding(code="lens", where=where, message="; ".join(filter(None, (error.found, error.do))))
            continue
        if camera.looks_past_frame:
            size, point = f"{camera.width} x {camera.height}", f"({camera.cx:g}, {camera.cy:g})"
            message = f"the principal point {point} is outside the picture of {size} pixels: check its size"
            yield Finding(code="lens-aside", where=where, message=message, severity=WARNING)
        yield from _derived_findings(prim, camera)


def _unsized(prim: Usd.Prim) -> Iterator[Finding]:
    """A camera that USD's own attributes and the RenderSettings' resolution do not make one of pixels, or whose numbers
    for that nothing reads."""
    if numbers := [name for name in prim.GetAuthoredPropertyNames() if name.startswith(LENS)]:
        message = f"the camera has {numbers[0]} without {schema.LENS_API}, so nothing reads it; apply the API"
        yield Finding(code="lens-none", where=str(prim.GetPath()), message=message, severity=WARNING)
    try:
        read_camera(prim, Usd.TimeCode.EarliestTime())
    except SpinError as error:
        if prim != _taken(prim.GetStage()):  # what is wrong with that one, its pictures tell
            message = f"the camera {error.found}, so no picture can be taken with it; {error.do}"
            yield Finding(code="lens-none", where=str(prim.GetPath()), message=message, severity=WARNING)


def _taken(stage: Usd.Stage) -> Usd.Prim | None:
    """The camera that render takes."""
    with suppress(SpinError):
        return find_camera(stage)
    return None


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
    """Whether the operation's type moves the target by more than a camera could tell. Single precision turns it by
    1e-7 rad, and hurts only where a way is much longer than the distance from the camera."""
    if op.GetPrecision() != UsdGeom.XformOp.PrecisionFloat:
        return bool(op.GetPrecision() == UsdGeom.XformOp.PrecisionHalf)
    if op.GetOpType() != UsdGeom.XformOp.TypeTranslate or not camera:
        return False
    for time in [Usd.TimeCode(t) for t in op.GetTimeSamples()] or [Usd.TimeCode.Default()]:
        step = np.spacing(np.abs(np.array(op.Get(time), np.float32)).max())
        world = UsdGeom.XformCache(time)
        here, there = (world.GetLocalToWorldTransform(prim).ExtractTranslation() for prim in (camera, target))
        if step > SEEN_RAD * (there - here).GetLength():
            return True
    return False


def _derived_findings(prim: Usd.Prim, camera: Camera) -> Iterator[Finding]:
    where = str(prim.GetPath())
    wanted = derived_values(camera, prim.GetAttribute("focalLength").Get())
    attributes = {name: prim.GetAttribute(name) for name in ("focalLength", *wanted)}
    absent = [name for name, attribute in attributes.items() if not (attribute and attribute.HasAuthoredValue())]
    if absent:
        message = f"the camera does not author {', '.join(absent)}, so other programs show another lens; author them"
        yield Finding(code="lens-derived", where=where, message=message, severity=WARNING)
    for name, want in wanted.items():
        if name not in absent and not _agree(have := attributes[name].Get(), want):
            message = f"{name} is {have}, but {want} follows from spin:lens:*, which is rendered: set it to that"
            yield Finding(code="lens-derived", where=where, message=message)


def _agree(have: object, want: object) -> bool:
    if isinstance(have, float) and isinstance(want, float):
        return abs(have - want) <= FLOAT32_STEP * abs(want) + 1e-12
    return have == want
