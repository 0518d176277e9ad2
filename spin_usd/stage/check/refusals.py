"""All errors of a stage's readers, each tried alone, since reading a picture ends at the first error."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import TypeAlias

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from spin_usd.errors import SpinError
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.transform import Transform
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.composition.images import Images
from spin_usd.stage.read.bodies.find_bodies import find_occluders, find_targets, occluder_roots
from spin_usd.stage.read.bodies.gprim import GprimReader
from spin_usd.stage.read.bodies.keypoints import read_keypoints
from spin_usd.stage.read.bodies.part_labels import Labels
from spin_usd.stage.read.bodies.point_instancer import read_instances
from spin_usd.stage.read.bodies.renderable import is_geometry, is_left_out
from spin_usd.stage.read.camera import find_camera, find_cameras, read_camera
from spin_usd.stage.read.environment import EnvironmentReader
from spin_usd.stage.read.frames import read_frames
from spin_usd.stage.read.lens import derived_values, read_lens
from spin_usd.stage.read.lights import LightReader, read_light, refuse_light, visible_lights
from spin_usd.stage.read.optics import read_optics, read_thin_lens
from spin_usd.stage.read.sensor import read_sensor
from spin_usd.stage.read.shutter import read_opening
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.camera_space import CameraSpace
from spin_usd.stage.usd.parser_faults import parser_faults
from spin_usd.stage.usd.root_metadata import Notes, metres_per_unit, root_number
from spin_usd.stage.usd.transforms import NORM_TOLERANCE, check_chain, op_types, orient_norm_error
from spin_usd.stage.usd.values import read
from spin_usd.stage.usd.visibility import PROXIES, RENDERED_PURPOSES, is_invisible, own_purpose

Attempt: TypeAlias = Callable[[], object]

NOWHERE = Transform(to="world", of="usdcam", rotation=np.eye(3), translation=np.zeros(3))
"""A camera's pose, for reading values that do not depend on it."""

ROUNDED_NORM = 1e-9  # of a quaternion printed with ten decimals: no label can show such a rotation
SEEN_RAD = 1e-6  # 0.003 px of SPEED+'s camera
LENS = "spin:lens:"
FLOAT32_STEP = 1e-6  # relative: derived values are rounded to float32


def refusals(stage: Usd.Stage) -> Iterator[SpinError]:
    """Yield the errors of the opened `stage` at its first frame, one for each prim."""
    for attempt in _attempts(stage):
        try:
            with parser_faults(stage.GetRootLayer().realPath):
                attempt()
        except SpinError as error:
            yield error


def _attempts(stage: Usd.Stage) -> Iterator[Attempt]:
    time = Usd.TimeCode.EarliestTime()
    with suppress(SpinError):
        time = Usd.TimeCode(read_frames(stage, "")[0].time_code)
    yield partial(metres_per_unit, stage)
    yield partial(read_frames, stage, "")
    yield from _of_camera(stage, time)
    yield from _of_bodies(stage, time)
    yield from _of_lights(stage, time)


def _of_camera(stage: Usd.Stage, time: Usd.TimeCode) -> Iterator[Attempt]:
    yield partial(find_cameras, stage)
    prims: tuple[Usd.Prim, ...] = ()
    with suppress(SpinError):
        prims = tuple(find_cameras(stage).values())
    for prim in prims:
        yield partial(check_chain, prim)
        yield partial(read_camera, prim, time)
        yield partial(read_sensor, prim, time)
        yield partial(read_thin_lens, prim, time, 1.0)
        yield partial(read_opening, prim, 0.0, rows=1)
        with suppress(SpinError):
            yield partial(read_optics, prim, read_camera(prim, time), time)


def _of_bodies(stage: Usd.Stage, time: Usd.TimeCode) -> Iterator[Attempt]:
    """Try the targets and the occluders; without a target all geometry of the stage, since one of its prims is
    meant."""
    yield partial(find_targets, stage)
    roots: list[Usd.Prim] = [stage.GetPseudoRoot()]
    with suppress(SpinError):
        targets = find_targets(stage)
        for target in targets:
            yield partial(check_chain, target)
            yield partial(read_keypoints, target, time)
        roots = [*targets]
        cameras = find_cameras(stage).values()
        yield partial(find_occluders, targets, cameras)
        roots += occluder_roots(targets, cameras)
    images = Images()
    for prim in (each for root in roots for each in _to_render(root, time)):
        yield partial(_read_geometry, prim, time, images)


def _to_render(root: Usd.Prim, time: Usd.TimeCode) -> Iterator[Usd.Prim]:
    """Yield all prims at and below `root` that are rendered at `time` if they are geometry; only one of equal
    instances."""
    waiting, seen = [(root, "default")], set()
    while waiting:
        prim, inherited = waiting.pop()
        own = (prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath()
        if own in seen or is_invisible(prim, time) or prim.IsA(UsdGeom.Subset):
            continue
        seen.add(own)
        purpose = own_purpose(prim, inherited)
        if purpose in RENDERED_PURPOSES:
            yield prim
        waiting += [(child, purpose) for child in reversed(prim.GetFilteredChildren(PROXIES))]


def _read_geometry(prim: Usd.Prim, time: Usd.TimeCode, images: Images) -> None:
    if is_left_out(prim, Notes()) or not is_geometry(prim):
        return
    if prim.IsA(UsdGeom.PointInstancer):
        list(read_instances(prim, time))
    else:
        GprimReader(time=time, images=images, visited=[], notes=Notes()).read(prim, Labels().of_gprim(prim))


def _of_lights(stage: Usd.Stage, time: Usd.TimeCode) -> Iterator[Attempt]:
    images, world = Images(), UsdGeom.XformCache(time)
    for prim in visible_lights(stage):
        yield partial(_read_light, prim, time, world, images)
    yield partial(LightReader, stage, images)
    yield partial(EnvironmentReader, stage, images)


def _read_light(prim: Usd.Prim, time: Usd.TimeCode, world: UsdGeom.XformCache, images: Images) -> None:
    refuse_light(prim)
    read_light(prim, CameraSpace(time=time, world=world, T_world_usdcam=NOWHERE, metres=1.0), images)


def capture_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """The stage's time codes are those of the frames that the default prim names."""
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
    camera = _render_camera(stage)
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
            if prim != _render_camera(stage):  # reading its pictures reports that one
                yield Finding(code="lens", where=where, message="; ".join(filter(None, (error.found, error.do))))
            continue
        if camera.looks_past_frame:
            size, point = f"{camera.width} x {camera.height}", f"({camera.cx:g}, {camera.cy:g})"
            message = f"the principal point {point} is outside the picture of {size} pixels: check its size"
            yield Finding(code="lens-aside", where=where, message=message, severity=WARNING)
        yield from _derived_findings(prim, camera)


def _unsized(prim: Usd.Prim) -> Iterator[Finding]:
    """Check a camera without our lens: USD's attributes and a resolution define it, and no spin:lens:* is ignored."""
    if numbers := [name for name in prim.GetAuthoredPropertyNames() if name.startswith(LENS)]:
        message = f"the camera has {numbers[0]} without {schema.LENS_API}, so nothing reads it; apply the API"
        yield Finding(code="lens-none", where=str(prim.GetPath()), message=message, severity=WARNING)
    try:
        read_camera(prim, Usd.TimeCode.EarliestTime())
    except SpinError as error:
        if prim != _render_camera(prim.GetStage()):  # reading its pictures reports that one
            message = f"the camera {error.found}, so no picture can be taken with it; {error.do}"
            yield Finding(code="lens-none", where=str(prim.GetPath()), message=message, severity=WARNING)


def _render_camera(stage: Usd.Stage) -> Usd.Prim | None:
    """Return the camera with which a render takes pictures, if there is one."""
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


def _derived_findings(prim: Usd.Prim, camera: Camera) -> Iterator[Finding]:
    where = str(prim.GetPath())
    derived = derived_values(camera, read(prim.GetAttribute("focalLength")))
    attributes = {name: prim.GetAttribute(name) for name in ("focalLength", *derived)}
    absent = [name for name, attribute in attributes.items() if not (attribute and attribute.HasAuthoredValue())]
    if absent:
        message = f"the camera does not author {', '.join(absent)}, so other programs show another lens; author them"
        yield Finding(code="lens-derived", where=where, message=message, severity=WARNING)
    for name, want in derived.items():
        if name not in absent and not _agree(have := read(attributes[name]), want):
            message = f"{name} is {have}, but {want} follows from spin:lens:*, which is rendered: set it to that"
            yield Finding(code="lens-derived", where=where, message=message)


def _agree(have: object, want: object) -> bool:
    if isinstance(have, float) and isinstance(want, float):
        return abs(have - want) <= FLOAT32_STEP * abs(want) + 1e-12
    return have == want
