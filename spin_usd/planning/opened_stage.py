"""What the child that opens a stage to plan it answers, before it plans any picture."""

from typing import Annotated

from msgspec import Meta, Struct

from spin_usd.records.descriptions import PartEntry, StageOrigin, TargetEntry


class StageContent(Struct, frozen=True, kw_only=True):
    """What all pictures of a stage share."""

    targets: list[TargetEntry]
    parts: dict[str, PartEntry]
    """Of all bodies, by their ids in labels."""
    bodies: int
    camera: Annotated[list[int], Meta(min_length=2, max_length=2)]
    """Columns and rows of a picture."""
    lidar: bool
    paired: bool
    """Whether a further camera sees what this one does."""


class OpenedStage(Struct, frozen=True, kw_only=True):
    """A stage that is opened to be planned."""

    root: str
    """Its root layer's path, or its copy's."""
    seed: int
    variants: list[str]
    """Those wanted, in their order."""
    device: str
    """The first of the devices offered that can render all of its pictures."""
    known_variants: list[str]
    """All that it has."""
    names: list[str]
    """Of all of its frames."""
    chosen: list[int]
    """Places of those wanted."""
    origin: StageOrigin
    """What it was made from."""
    content: StageContent
    trial_s: float | None
    """Seconds of a trial of this machine, where that was asked."""
