"""Validation of a user's document: a sentence with the key of the first fault, or the document as its type."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from typing import Any, TypeVar

import msgspec
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError, best_match
from jsonschema.validators import extend

from spin_usd.basics.resources import schemas
from spin_usd.errors import InputError

T = TypeVar("T")
FEW = 8  # names that a sentence can list
FIELD = re.compile(r"\^(\w+)\\\..*?[+)]\\\.\(?([\w|.\\]+)\)?\$")
"""A pattern of names such as ^part\\..+\\.turn$: what it is of, and the fields, with | between them."""

IN_TOML = {
    "object": "a table { ... }",
    "array": "a list [ ... ]",
    "integer": "a whole number",
    "number": "a number",
    "string": 'a text "..."',
    "boolean": "true or false",
}
"""Names of JSON's types for users of TOML."""


def check_document(document: Any, schema: str, where: object) -> None:
    """Raise InputError, in a sentence that names the key, where `document` breaks the schema of that name."""
    _check(document, _validator(schema), where)


def _check(document: Any, validator: Any, where: object) -> None:
    error = best_match(validator.iter_errors(document))
    if error is not None:
        key = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in error.absolute_path).lstrip(".")
        raise InputError(f"{key}: {_sentence(error)}" if key else _sentence(error), where=where)


def read_as(kind: type[T], tables: Mapping[str, Any], where: object) -> T:
    """Return the tables as of that type. Raises InputError that names the key that is wrong."""
    try:
        return msgspec.convert(tables, kind)
    except msgspec.ValidationError as error:
        if not isinstance(error.__cause__, InputError):
            _check(tables, _Validator(msgspec.json.schema(kind)), where)
    try:
        return msgspec.convert(tables, kind, strict=False)  # so that 4.0 is a whole number
    except msgspec.ValidationError as error:
        found, _, path = str(error).partition(" - at `$.")
        cause = error.__cause__ if isinstance(error.__cause__, InputError) else InputError(found)
        said = f"{path.rstrip('`')}: {cause.found}" if path else cause.found
        raise InputError(said, where=where, do=cause.do) from None


def _sentence(error: ValidationError) -> str:
    """Return the finding of jsonschema, shorter where it prints whole tables."""
    if error.validator == "additionalProperties" and isinstance(error.instance, dict):
        schema = dict(error.schema) if isinstance(error.schema, Mapping) else {}
        choices, patterns = list(schema.get("properties", {})), schema.get("patternProperties", {})
        named = [*choices, *(key for key in error.instance if any(re.search(pattern, key) for pattern in patterns))]
        unknown = next(key for key in error.instance if key not in named)
        listed = ", ".join(choices)
        if len(choices) <= FEW:
            return f"there is no {unknown!r}; choose among {listed}"
        near = _near_field(unknown, patterns) or next(iter(get_close_matches(unknown, choices)), "")
        hints = [f"is {near} meant?"] if near else []
        if patterns:
            hints.append("spin-usd augment --list shows all")
        return f"there is no {unknown!r}; {' '.join(hints) or f'choose among {listed}'}"
    if error.validator == "required":
        return str(error.message).replace(" is a required property", " is missing") + _choices_of_missing(error)
    if error.validator == "type" and str(error.validator_value) in IN_TOML:
        schema = dict(error.schema) if isinstance(error.schema, Mapping) else {}
        keys = ", ".join(schema.get("properties", schema.get("required", ())))
        return f"{error.instance!r} is not {IN_TOML[str(error.validator_value)]}{f' of {keys}' if keys else ''}"
    if error.validator in ("anyOf", "oneOf") and error.context:
        forms: dict[object, list[ValidationError]] = {}
        for each in error.context:
            forms.setdefault(each.schema_path[0], []).append(each)
        nearest = [_sentence(best_match(errors)) for errors in forms.values()]
        if len(nearest) == 1:
            return nearest[0]
        return f"fits none of its forms: {'; or '.join(dict.fromkeys(nearest))}"
    return str(error.message)


def _near_field(unknown: str, patterns: Iterable[str]) -> str:
    """Return an unknown name such as part.Bus.bulge with the field nearest to its own, of names of the `patterns`; ""
    if none is near."""
    kind, _, rest = unknown.partition(".")
    name, _, field = rest.partition(".")
    found = [match for pattern in patterns if (match := FIELD.fullmatch(pattern)) and match[1] == kind]
    fields = [each for match in found for each in match[2].replace("\\", "").split("|")]
    near = [each for each in fields if field and each.startswith(field)] or get_close_matches(field, fields, n=1)
    return f"{kind}.{name}.{near[0]}" if near else ""


def _choices_of_missing(error: ValidationError) -> str:
    """Return a hint on the value of the missing key, "" if the schema does not list values."""
    schema: Any = error.schema
    document: Any = error.instance
    missing = next(key for key in schema["required"] if key not in document)
    choices = schema.get("properties", {}).get(missing, {}).get("enum", ())
    return f": add {missing} = {' or '.join(map(json.dumps, choices))}" if choices else ""


def _of_any(validator: Any, forms: Any, instance: Any, schema: Mapping[str, Any]) -> Iterator[ValidationError]:
    """Yield the faults of a value that fits none of the forms; if a key names the form, of that form only. Null is
    no form that a message lists, for TOML has none."""
    if instance is not None:
        forms = [form for form in forms if form != {"type": "null"}]
    if "discriminator" not in schema or not isinstance(instance, dict):
        yield from Draft202012Validator.VALIDATORS["anyOf"](validator, forms, instance, schema)
        return
    key, kinds = (schema["discriminator"][part] for part in ("propertyName", "mapping"))
    if instance.get(key) in list(kinds):
        yield from validator.descend(instance, {"$ref": kinds[instance[key]]})
    elif key in instance:
        yield ValidationError(f"{instance[key]!r} is not one of {', '.join(kinds)}", path=[key])


_Validator = extend(Draft202012Validator, {"anyOf": _of_any})  # type: ignore[no-untyped-call]


@cache
def _validator(schema: str) -> Any:
    text = (schemas() / f"{schema}.schema.json").read_text(encoding="utf-8")
    return _Validator(json.loads(text))
