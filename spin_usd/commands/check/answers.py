"""Answers of children of `check` about a stage or a picture."""

from msgspec import Struct

from spin_usd.records.record import StageProvenance
from spin_usd.scene.derived.views import Views
from spin_usd.scene.finding import Finding
from spin_usd.store.cache import Purpose


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
