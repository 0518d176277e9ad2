"""JSON that a user gives: every way in which a file can be none, said in a sentence."""

import json
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError


def read_json_file(path: Path) -> Any:
    """The JSON value in the file at `path`, or InputError."""
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=path) from None
    except UnicodeDecodeError:
        raise InputError("is not a text file", where=path, do="give a JSON file") from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"is not JSON: {error.msg} at line {error.lineno}, column {error.colno}",
            where=path,
            do="check that the file is whole",
        ) from None
    except (ValueError, RecursionError):
        raise InputError("holds a number or a nesting that is too long", where=path) from None
