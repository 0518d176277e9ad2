"""A picture of a dataset as the rules of `check` see it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from spin_usd.records.descriptions import DatasetDescription
from spin_usd.records.record import Record


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedPicture:
    """A picture whose record is valid."""

    where: str
    """The record's path in the dataset, for findings."""
    record: Record
    description: DatasetDescription
    """The dataset's."""
    arrays: Mapping[str, NDArray[Any]]
    """The numbers of each of its files by kind: (H, W) or (H, W, C) pixels, or (N,) points of a LiDAR. Empty unless all
    files are intact."""
