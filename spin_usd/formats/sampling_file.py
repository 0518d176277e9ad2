"""Sampling specifications as TOML files. What may stand in one is in schemas/sample-1.schema.json."""

import tomllib
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError


def read_sampling_file(path: str | Path) -> dict[str, Any]:
    """Read the tables of the file at `path`, not yet held against their schema. Raises InputError that names the
    file."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=path) from None
    except UnicodeDecodeError:
        raise InputError("is not a text file", where=path, do="give a TOML file") from None
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        raise InputError(f"is not TOML: {error}", where=path, do="fix it there") from None
