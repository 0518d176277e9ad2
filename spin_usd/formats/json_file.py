"""JSON from a user, with one sentence for every way in which a file can be invalid."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

from spin_usd.basics.nesting import NestingError, parsed_json
from spin_usd.errors import InputError
from spin_usd.files.user_file import read_text


def read_json_file(path: Path, max_bytes: int) -> Any:
    """Read the JSON value in the file at `path`, of at most `max_bytes`. Raises InputError where it holds none."""
    try:
        return parsed_json(read_text(path, max_bytes), object_pairs_hook=_object)
    except InputError as error:
        raise InputError(error.found, where=path, do=error.do) from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"is not JSON: {error.msg} at line {error.lineno}, column {error.colno}",
            where=path,
            do="check that the file is whole",
        ) from None
    except NestingError as error:
        raise InputError(f"cannot be read: {error}", where=path) from None
    except ValueError:
        raise InputError("holds a number that is too long", where=path) from None


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make an object. Raises InputError for a key that stands twice: JSON readers silently take the last."""
    made = dict(pairs)
    if len(made) < len(pairs):
        ((twice, _),) = Counter(key for key, _ in pairs).most_common(1)
        raise InputError(f"has the key {twice!r} twice in one object", do="keep one of them")
    return made
