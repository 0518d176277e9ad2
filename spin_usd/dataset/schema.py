"""The JSON Schemas of everything that others read."""

import json
from functools import cache
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from spin_usd import resources
from spin_usd.errors import InputError


def read_json(path: Path, schema: str) -> dict[str, Any]:
    """The JSON object in `path`, valid by the schema named (such as "record-1"); InputError says what is wrong."""
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except OSError as e:
        raise InputError(f"cannot be read ({e.strerror})", where=path) from e
    except ValueError as e:
        raise InputError(f"is not JSON ({e})", where=path) from e
    error = best_match(_validator(schema).iter_errors(value))
    if error is not None:
        raise InputError(f"breaks schema {schema} at {error.json_path}: {error.message}", where=path)
    result: dict[str, Any] = value
    return result


@cache
def _validator(schema: str) -> Draft202012Validator:
    text = (resources.schemas() / f"{schema}.schema.json").read_text(encoding="utf-8")
    return Draft202012Validator(json.loads(text))
