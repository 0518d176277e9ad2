"""TOML that a user gives: every way in which a file can be none, said in a sentence."""

from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.files.user_file import decoded, read_bytes
from spin_usd.nesting import parsed_toml


def read_toml_file(path: Path, max_bytes: int) -> dict[str, Any]:
    """Read the tables of the file at `path`, of at most `max_bytes`. Raises InputError where it holds none."""
    return tables_in(read_bytes(path, max_bytes), path)


def tables_in(data: bytes, where: object) -> dict[str, Any]:
    """Return the tables in the `data` of a file. Raises InputError."""
    text = decoded(data, where)
    try:
        return parsed_toml(text)
    except ValueError as error:
        raise InputError(f"is not TOML: {error}", where=where, do="fix it there") from None
