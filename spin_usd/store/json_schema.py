"""The JSON Schemas of everything that others read."""

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from spin_usd.basics import resources
from spin_usd.basics.nesting import finite_json
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_DOCUMENT

if TYPE_CHECKING:
    from jsonschema.exceptions import ValidationError

REMEDY = "restore it, or make it again"


def read_json(folder: Folder, name: str, schema: str) -> dict[str, Any]:
    """Read the JSON object in the file `name` of the folder, valid by the schema named (such as "record-1"), its
    numbers finite; InputError reports the fault."""
    return valid(folder.read(name, MAX_DOCUMENT), schema, folder.root / name)


def valid(data: bytes, schema: str, where: Path, *, do: str = REMEDY) -> dict[str, Any]:
    """Return the JSON object in the `data` of a file, valid by the schema named, its numbers finite; InputError reports
    the fault, and the remedy `do`."""
    try:
        value = finite_json(data.decode("utf-8"))
        error = _worst_error(value, schema)
    except ValueError as e:
        raise InputError(f"is not JSON ({e})", where=where, do=do) from e
    except RecursionError:
        raise InputError("is nested too deeply", where=where, do=do) from None
    if error is not None:
        raise InputError(f"breaks schema {schema} at {error.json_path}: {error.message}", where=where, do=do)
    result: dict[str, Any] = value
    return result


def _worst_error(value: Any, schema: str) -> "ValidationError | None":
    """Return the worst fault of the value by the schema named; None if it is valid."""
    from jsonschema.exceptions import best_match  # not above: jsonschema is slow to load, and a new dataset needs none

    worst: ValidationError | None = best_match(_validator(schema).iter_errors(value))
    return worst


def _is_integer(_: object, value: object) -> bool:
    """Return whether the value is an integer; JSON Schema's own test takes 3.0 for one too."""
    return isinstance(value, int) and not isinstance(value, bool)


@cache
def _validator(schema: str) -> Any:
    from jsonschema import Draft202012Validator  # not above: see _worst_error
    from jsonschema.validators import extend

    types = Draft202012Validator.TYPE_CHECKER.redefine("integer", _is_integer)
    validator = extend(Draft202012Validator, type_checker=types)  # type: ignore[no-untyped-call]
    text = (resources.schemas() / f"{schema}.schema.json").read_text(encoding="utf-8")
    return validator(json.loads(text))
