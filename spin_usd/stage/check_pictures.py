"""Rules on what makes the pictures: their names, the target's poses, the camera and what is derived from its lens."""

from collections.abc import Iterator

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdRender

from spin_usd.errors import SpinError
from spin_usd.geometry.camera import Camera
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.scene.poses import FRAME_NAME, repeated_name
from spin_usd.stage import schema
from spin_usd.stage.cameras import find_camera, read_camera
from spin_usd.stage.captures import read_frames
from spin_usd.stage.check_sensor import sensor_findings
from spin_usd.stage.convert import quaternion
from spin_usd.stage.lens import derived_values, read_lens

FLOAT32_STEP = 1e-6  # relative: derived values are rounded to float32
UNIT_NORM = 1e-9  # of a quaternion in double precision
UNIT_NORM_FLOAT = 1e-5


def capture_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """The default prim names each picture; names are good file stems, each its own."""
    prim = stage.GetDefaultPrim()
    where = str(prim.GetPath()) if prim else "/"
    attribute = prim.GetAttribute(schema.CAPTURE_FRAME) if prim else Usd.Attribute()
    times = attribute.GetTimeSamples() if attribute else []
    if not times:
        yield from _range_findings(stage)
        return
    names = [str(attribute.Get(time)) for time in times]
    for name, time in zip(names, times, strict=True):
        if not FRAME_NAME.fullmatch(name):
            yield Finding(code="capture-name", where=where, message=f"{name!r} at time {time:g} cannot name a picture")
    if repeated_name(names):
        yield Finding(code="capture-name", where=where, message="two pictures have the same name")
    if (stage.GetStartTimeCode(), stage.GetEndTimeCode()) != (times[0], times[-1]):
        yield Finding(
            code="capture-range",
            where=where,
            message=f"the stage runs from {stage.GetStartTimeCode():g} to {stage.GetEndTimeCode():g}, "
            f"its pictures from {times[0]:g} to {times[-1]:g}",
            severity=WARNING,
        )


def pose_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """There is one target, and its time samples are finite rigid motions in double precision."""
    targets = [prim for prim in stage.Traverse() if prim.HasAPI(schema.TARGET_API)]
    if len(targets) != 1:
        yield Finding(
            code="target-count", where="/", message=f"{len(targets)} prims have {schema.TARGET_API}, expected one"
        )
    for target in targets:
        for op in UsdGeom.Xformable(target).GetOrderedXformOps():
            yield from _op_findings(op.GetAttr(), str(target.GetPath()))


def camera_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """There is one that render takes; every sensor, optics and lens is one, and USD's own attributes and
    omni:lensdistortion:* follow from the lens."""
    try:
        chosen = find_camera(stage).GetPath()
    except SpinError as error:
        yield Finding(code="camera-none", where="/", message=error.found)
        chosen = Sdf.Path()
    for prim in (prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)):
        where = str(prim.GetPath())
        yield from sensor_findings(prim)
        if not prim.HasAPI(schema.LENS_API):
            yield from _lensless_findings(prim, is_chosen=prim.GetPath() == chosen)
            continue
        try:
            camera = read_lens(prim)
            camera.check_invertible()
        except SpinError as error:
            yield Finding(code="lens", where=where, message=error.found)
            continue
        yield from _derived_findings(prim, camera)
        yield from _resolution_findings(stage, prim, camera)


def _range_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Without names there is a picture for each whole step of the stage's time codes."""
    try:
        read_frames(stage)
    except SpinError as error:
        yield Finding(code="capture-none", where="/", message=error.found)


def _lensless_findings(prim: Usd.Prim, *, is_chosen: bool) -> Iterator[Finding]:
    """Apertures will do for a picture, if there is a resolution."""
    where = str(prim.GetPath())
    message = f"the camera has no {schema.LENS_API}: its intrinsics are not given in pixels"
    yield Finding(code="lens-none", where=where, message=message, severity=WARNING)
    try:
        if is_chosen:
            read_camera(prim, Usd.TimeCode(prim.GetStage().GetStartTimeCode()))
    except SpinError as error:
        yield Finding(code="lens", where=where, message=f"the camera {error.found}; {error.do}")


def _op_findings(attribute: Usd.Attribute, where: str) -> Iterator[Finding]:
    times = attribute.GetTimeSamples() or [Usd.TimeCode.Default()]
    values = [attribute.Get(time) for time in times]
    name, kind = attribute.GetName(), attribute.GetTypeName()
    if isinstance(values[0], Gf.Matrix4d) and len(values) > 1:
        message = f"{name} has {len(values)} matrices, which shear between time samples: use translate and orient"
        yield Finding(code="pose-matrix", where=where, message=message, severity=WARNING)
    if kind not in (Sdf.ValueTypeNames.Double3, Sdf.ValueTypeNames.Quatd, Sdf.ValueTypeNames.Matrix4d):
        message = f"{name} is {kind}, which rounds the pose: use double3 and quatd"
        yield Finding(code="pose-precision", where=where, message=message, severity=WARNING)
    rotations = isinstance(values[0], Gf.Quatd | Gf.Quatf | Gf.Quath)
    numbers = np.array([quaternion(v) if rotations else np.ravel(v) for v in values], np.float64)
    bad = ~np.isfinite(numbers).all(1)
    if bad.any():
        yield Finding(code="pose", where=where, message=f"{name} is not finite at time {times[int(bad.argmax())]}")
    elif rotations:
        tolerance = UNIT_NORM if kind == Sdf.ValueTypeNames.Quatd else UNIT_NORM_FLOAT
        bad = np.abs(np.linalg.norm(numbers, axis=1) - 1) > tolerance
        if bad.any():
            at = times[int(bad.argmax())]
            yield Finding(code="pose", where=where, message=f"{name} is not a unit quaternion at time {at}")


def _derived_findings(prim: Usd.Prim, camera: Camera) -> Iterator[Finding]:
    where = str(prim.GetPath())
    wanted = derived_values(camera, prim.GetAttribute("focalLength").Get())
    attributes = {name: prim.GetAttribute(name) for name in ("focalLength", *wanted)}
    absent = [name for name, attribute in attributes.items() if not (attribute and attribute.HasAuthoredValue())]
    if absent:
        message = f"the camera does not author {', '.join(absent)}, by which other programs know its lens"
        yield Finding(code="lens-derived", where=where, message=message, severity=WARNING)
    for name, want in wanted.items():
        if name not in absent and not _agree(have := attributes[name].Get(), want):
            message = f"{name} is {have}, but {want} follows from the lens in spin:lens:*"
            yield Finding(code="lens-derived", where=where, message=message)


def _agree(have: object, want: object) -> bool:
    if isinstance(have, float) and isinstance(want, float):
        return abs(have - want) <= FLOAT32_STEP * abs(want) + 1e-12
    return have == want


def _resolution_findings(stage: Usd.Stage, prim: Usd.Prim, camera: Camera) -> Iterator[Finding]:
    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    if not settings or prim.GetPath() not in settings.GetCameraRel().GetForwardedTargets():
        return
    have = tuple(settings.GetResolutionAttr().Get())
    if have != (camera.width, camera.height):
        yield Finding(
            code="resolution",
            where=str(settings.GetPath()),
            message=f"the resolution is {have}, the lens is of {camera.width} x {camera.height} pixels",
        )
