"""The report of a merge."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class MergeReport:
    """The report of what a merge did.

    out: its folder · pictures: how many it holds · added, kept: of those of the shards, how many were added, and were
    there already · missing: how many pictures are still to come, by shard ("1/3"), where that is known · seconds:
    wall-clock.
    """

    out: str
    pictures: int
    added: int
    kept: int
    missing: Mapping[str, int]
    seconds: float
