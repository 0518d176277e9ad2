"""The report of an export."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ExportReport:
    """The report of what an export did.

    out: its folder · format: its name · pictures: how many it holds · splits: how many each split holds · left_out: how
    many show nothing of the target, where the format cannot hold those · linked, made, kept: files that were linked or
    copied, made, and there already · made_endings: how many were made of each ending · seconds: wall-clock.
    """

    out: str
    format: str
    pictures: int
    splits: Mapping[str, int]
    left_out: int
    linked: int
    made: int
    kept: int
    made_endings: Mapping[str, int]
    seconds: float
