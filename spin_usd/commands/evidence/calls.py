"""The calls of children that gather evidence: one measures a picture, the other makes pictures of test charts."""

from msgspec import Struct

from spin_usd.commands.evidence.report import Calibrated
from spin_usd.processes.call import Call
from spin_usd.scene.derived.content_keys import RenderSettings


class PictureRow(Struct, frozen=True, kw_only=True):
    """The values of a picture; None for unknown ones."""

    name: str
    variant: str
    range: float | None = None
    """Metres from the camera to the target's origin."""
    sun: float | None = None
    """Angle at the target between Sun and camera, degrees."""
    attitude: tuple[float, float, float] | None = None
    """Direction from the target to the camera, body axes."""
    roll: float | None = None
    """Direction of the body's z axis in the image, degrees clockwise from up."""
    visible: float | None = None
    signal_to_noise: float | None = None
    """Median signal on the target over its noise, both as measured in the image."""
    background: str | None = None
    size: float | None = None
    """Longer side of the box of the target's whole outline, pixels."""
    blur: float | None = None
    """Farthest way of a corner of the target's box in the exposure, pixels."""


class MeasureRow(Struct, frozen=True, kw_only=True):
    """The request for the row of a picture."""

    dataset: str
    record: str
    """Name of the record."""


class Calibrate(Struct, frozen=True, kw_only=True):
    """The request for pictures of charts by the camera of a stage."""

    stage: str
    variant: str
    settings: RenderSettings


_ROOM = "spin_usd.commands.evidence"
MEASURE_ROW = Call(f"{_ROOM}.picture_row:picture_row", MeasureRow, PictureRow)
CALIBRATE = Call(f"{_ROOM}.calibration:calibrated", Calibrate, dict[str, Calibrated])
"""Answers with the properties by name."""
