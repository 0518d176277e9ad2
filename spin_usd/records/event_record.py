"""The record beside the events of a variant: the stage, the camera and the settings that made them."""

from typing import Annotated, Any

from msgspec import Meta

from spin_usd.basics.json_fields import Count, FileName, JsonStruct, Sha256, Size
from spin_usd.records.record import RecordedCamera


class EventRecord(JsonStruct, frozen=True, kw_only=True, tag_field="schema", tag="events-1"):
    """The events of a variant."""

    variant: str
    file: Annotated[FileName, Meta(description="Relative to the dataset: HDF5 as DSEC lays it out.")]
    sha256: Sha256
    key: Annotated[str, Meta(description="Digest of all that decides the events.")]
    events: Annotated[Count, Meta(description="How many.")]
    start: Annotated[float, Meta(description="When they begin, seconds on the stage's clock.")]
    duration: Annotated[Size, Meta(description="Seconds.")]
    steps: Annotated[Count, Meta(description="At how many times the light was made.")]
    renders: Annotated[Count, Meta(description="How many of those were rendered.")]
    labelled: Annotated[bool, Meta(description="Whether each event has the ids of target and part.")]
    sensor: Annotated[dict[str, float], Meta(description="Parameters of the pixels, by name (scene.event_sensor).")]
    exposure: Annotated[Size, Meta(description="Factor from W/m2/sr to the unit range.")]
    camera: RecordedCamera
    stage: Annotated[Sha256, Meta(description="Digest of the stage's composed content.")]
    settings: Annotated[dict[str, Any], Meta(description="Settings of the renders: renderer, effort, seed, device.")]
    versions: Annotated[dict[str, str], Meta(description="Of the software, by name.")]
