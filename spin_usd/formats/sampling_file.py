"""Sampling specifications as TOML files. What may stand in one is in schemas/sample-1.schema.json."""

from pathlib import Path
from typing import Any

from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.toml_file import read_toml_file


def read_sampling_file(path: str | Path) -> dict[str, Any]:
    """Read the tables of the file at `path`, not yet held against their schema. Raises InputError that names the
    file."""
    return read_toml_file(Path(path), MAX_SPECIFICATION)
