"""Rules on the cameras of a stage: each has a size in pixels, and USD's lens attributes agree with ours."""

from collections.abc import Iterator
from contextlib import suppress

from pxr import Usd, UsdGeom

from spin_usd.errors import SpinError
from spin_usd.geometry.camera import Camera
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.read.camera import find_camera, read_camera
from spin_usd.stage.read.lens import derived_values, read_lens
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.values import read

LENS = "spin:lens:"
FLOAT32_STEP = 1e-6  # relative: derived values are rounded to float32


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
            if prim != render_camera(stage):  # reading its pictures reports that one
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
        if prim != render_camera(prim.GetStage()):  # reading its pictures reports that one
            message = f"the camera {error.found}, so no picture can be taken with it; {error.do}"
            yield Finding(code="lens-none", where=str(prim.GetPath()), message=message, severity=WARNING)


def render_camera(stage: Usd.Stage) -> Usd.Prim | None:
    """Return the camera with which a render takes pictures, if there is one."""
    with suppress(SpinError):
        return find_camera(stage)
    return None


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
