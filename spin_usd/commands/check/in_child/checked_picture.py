"""A picture of a dataset as the rules of `check` see it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from spin_usd.records.descriptions import DatasetDescription
from spin_usd.records.record import Record


@dataclass(frozen=True, kw_only=True, eq=False)
class CheckedPicture:
    """A picture whose record is valid.

    where: the record's path in the dataset, for findings · record, description: its own and the dataset's · arrays: the
    numbers of each of its files by kind, (H, W) or (H, W, C) pixels, or (N,) points of a LiDAR; none unless all files
    are whole.
    """

    where: str
    record: Record
    description: DatasetDescription
    arrays: Mapping[str, NDArray[Any]]
