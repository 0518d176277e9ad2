"""The call of the child that exports, and its report."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from spin_usd.processes.call import Call


@dataclass(frozen=True, kw_only=True)
class ExportReport:
    """The report of an export."""

    out: str
    """Its folder."""
    format: str
    """Its format's name."""
    pictures: int
    """How many it holds."""
    splits: Mapping[str, int]
    """How many pictures each split holds."""
    left_out: int
    """How many do not show the target, where the format cannot hold those or the target was requested."""
    linked: int
    """Files that were linked or copied."""
    made: int
    """Files that were made."""
    kept: int
    """Files that were there already."""
    made_endings: Mapping[str, int]
    """How many files were made of each ending."""
    seconds: float
    """Wall-clock time."""
    notes: tuple[str, ...] = ()
    """Sentences on what readers of the format may not take."""


EXPORT = Call("spin_usd.commands.export.in_child:export", dict[str, Any], ExportReport)
"""Its request is ExportOptions as JSON."""
