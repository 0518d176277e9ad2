"""Rules on a camera's sensor, optics, shutter and aperture: the same as for a render."""

from collections.abc import Iterator
from contextlib import suppress

from pxr import Usd, UsdGeom

from spin_usd.errors import SpinError
from spin_usd.scene.finding import Finding
from spin_usd.stage.cameras import read_camera
from spin_usd.stage.optics import read_optics
from spin_usd.stage.sensor import read_sensor
from spin_usd.stage.shutter import read_opening
from spin_usd.stage.thin_lens import read_thin_lens


def sensor_findings(prim: Usd.Prim) -> Iterator[Finding]:
    """What a render would refuse of the camera `prim`, but for its lens, at the stage's start."""
    time = Usd.TimeCode(prim.GetStage().GetStartTimeCode())
    try:
        read_sensor(prim, time)
    except SpinError as error:
        yield _finding("sensor", error)
    with suppress(SpinError):  # a lens that is none has findings of its own
        camera = read_camera(prim, time)
        try:
            read_optics(prim, camera, time)
        except SpinError as error:
            yield _finding("optics", error)
    try:
        read_opening(prim, time.GetValue(), rows=2)
        read_thin_lens(prim, time, UsdGeom.GetStageMetersPerUnit(prim.GetStage()))
    except SpinError as error:
        yield _finding("exposure", error)


def _finding(code: str, error: SpinError) -> Finding:
    return Finding(code=code, where=str(error.where), message=f"{error.found}; {error.do}")
