"""The calls of children that check: a stage, a picture, its labels against Cycles, and the events of a variant."""

from msgspec import Struct

from spin_usd.audit.picture_measures import DrawPicture, MeasurePictures, ModelFile, PictureMeasures, TraceOutlines
from spin_usd.processes.call import Call
from spin_usd.records.record import StageProvenance
from spin_usd.scene.derived.views import Views
from spin_usd.scene.finding import Finding
from spin_usd.store.cache import Purpose


class CheckPicture(Struct, frozen=True, kw_only=True):
    """The request to check a picture of a dataset."""

    dataset: str
    record: str
    """Name of the record."""


class CheckEvents(Struct, frozen=True, kw_only=True):
    """The request to check the events of a variant."""

    dataset: str
    variant: str


class CheckStage(Struct, frozen=True, kw_only=True):
    """The request to check a stage."""

    stage: str


class StageAnswer(Struct, frozen=True, kw_only=True):
    """The findings on a stage."""

    findings: list[Finding]
    views: Views | None = None
    """Summary of what its pictures show, if they can be read."""


class ListedPicture(Struct, frozen=True, kw_only=True):
    """Contents of a valid record."""

    variant: str
    stage: StageProvenance
    files: list[str]
    """Their names, all verified."""
    uses: list[Purpose]
    """Of the cache."""


class PictureAnswer(Struct, frozen=True, kw_only=True):
    """The findings on a picture."""

    findings: list[Finding]
    listed: ListedPicture | None = None
    """None where its record is not valid."""


class CrossAnswer(Struct, frozen=True, kw_only=True):
    """Differences between a picture's labels and Cycles' labels."""

    findings: list[Finding]
    compared: bool
    """Whether they were compared."""


_IN_CHILD = "spin_usd.commands.check.in_child"
CHECK_STAGE = Call(f"{_IN_CHILD}.stage:stage_findings", CheckStage, StageAnswer)
CHECK_PICTURE = Call(f"{_IN_CHILD}.picture:picture_findings", CheckPicture, PictureAnswer)
CHECK_EVENTS = Call(f"{_IN_CHILD}.events:event_findings", CheckEvents, list[Finding])
CROSS_PICTURE = Call(f"{_IN_CHILD}.cross:cross_findings", CheckPicture, CrossAnswer)
MEASURE_PICTURES = Call(f"{_IN_CHILD}.set_pictures:set_picture_measures", MeasurePictures, list[PictureMeasures])
MODEL_POINTS = Call(f"{_IN_CHILD}.set_pictures:model_points", ModelFile, list[list[float]])
DRAW_PICTURE = Call(f"{_IN_CHILD}.drawn_picture:drawn_picture", DrawPicture, str)
TRACE_OUTLINES = Call(f"{_IN_CHILD}.outlines:outline_scores", TraceOutlines, list[list[float]])
