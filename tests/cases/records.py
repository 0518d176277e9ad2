"""The records of a dataset, each valid by its schema."""

from pathlib import Path
from typing import Any

from spin_usd.store.json_schema import valid


def record_at(path: Path) -> dict[str, Any]:
    """The record in the file at `path`."""
    return valid(path.read_bytes(), "record-1", path)


def record_files(dataset: Path) -> list[Path]:
    """The records' files, ordered by variant and frame."""
    return sorted(dataset.glob("records/*/*.json"))


def records_of(dataset: Path) -> list[dict[str, Any]]:
    """All records, in that order."""
    return list(map(record_at, record_files(dataset)))
