"""Specifications of augmentations: TOML, valid by schemas/augment-1.schema.json."""

import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError, best_match
from jsonschema.validators import extend

from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.files.user_file import read_bytes
from spin_usd.formats.text_file import tables_in
from spin_usd.resources import schemas
from spin_usd.scene.model import NOMINAL

SCHEMA = "augment-1"
FRAME = "frame"
IN_TURN = "in_turn"
FEW = 8  # names that a sentence can list
RESERVED = {NOMINAL: "the stage without augmentation", "all": "every variant together"}  # as --variants has them
LONGEST_NAME = 100  # it names files too, beside a suffix


@dataclass(frozen=True, kw_only=True)
class SampleEntry:
    """The distribution of one parameter: `words` name it and its numbers, in `unit`."""

    parameter: str
    words: Mapping[str, Any]
    unit: str | None = None
    per_frame: bool = False


@dataclass(frozen=True, kw_only=True)
class AugmentationEntry:
    """One augmentation: a name of its own, the variants it selects (set -> variant), the parameters that it samples."""

    name: str
    select: Mapping[str, str] = field(default_factory=dict)
    sample: tuple[SampleEntry, ...] = ()
    constraints: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Specification:
    """`name`: the file's stem · `sha256`: of its bytes · augmentations: each entry as often as its count says."""

    name: str
    sha256: str
    seed: int
    augmentations: tuple[AugmentationEntry, ...]


def read_spec_file(path: str | Path) -> Specification:
    """Read the specification in the file at `path`. Raises InputError that names the key that is wrong."""
    path = Path(path)
    data = read_bytes(path, MAX_SPECIFICATION)
    document = tables_in(data, path)
    check_document(document, SCHEMA, path)
    entries = tuple(entry for table in document["augmentation"] for entry in _entries(table))
    names = [entry.name for entry in entries]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two augmentations are named {name!r}", where=path, do="rename one")
        if name in RESERVED:
            raise InputError(f"{name!r} is the name of {RESERVED[name]}", where=path, do="choose another")
        if len(name) > LONGEST_NAME:
            found = f"an augmentation's name has {len(name)} characters: {name[:20]}..."
            raise InputError(found, where=path, do=f"take {LONGEST_NAME} at most")
    return Specification(
        name=path.stem,
        sha256=hashlib.sha256(data).hexdigest(),
        seed=document.get("seed", 0),
        augmentations=entries,
    )


def samples_of(table: Mapping[str, Mapping[str, Any]]) -> tuple[SampleEntry, ...]:
    """Return a `sample` table: parameter -> its distribution, with `unit` and `per` among the distribution's own
    words."""
    return tuple(
        SampleEntry(
            parameter=name,
            words={key: value for key, value in words.items() if key not in ("unit", "per")},
            unit=words.get("unit"),
            per_frame=words.get("per") == FRAME,
        )
        for name, words in table.items()
    )


IN_TOML = {"object": "a table { ... }", "array": "a list [ ... ]"}
"""What TOML's users call JSON's types."""


def check_document(document: Any, schema: str, where: object) -> None:
    """Raise InputError, in a sentence that names the key, where `document` breaks the schema of that name."""
    error = best_match(_validator(schema).iter_errors(document))
    if error is not None:
        key = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in error.absolute_path).lstrip(".")
        raise InputError(f"{key}: {_sentence(error)}" if key else _sentence(error), where=where)


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
        near = get_close_matches(unknown, choices)
        hints = [f"is {near[0]} meant?"] if near else []
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
        return f"fits none of its forms: {'; or '.join(dict.fromkeys(nearest))}"
    return str(error.message)


def _choices_of_missing(error: ValidationError) -> str:
    """Return a hint on what to add for the missing key, "" where the schema does not list its values."""
    schema: Any = error.schema
    document: Any = error.instance
    missing = next(key for key in schema["required"] if key not in document)
    choices = schema.get("properties", {}).get(missing, {}).get("enum", ())
    return f": add {missing} = {' or '.join(map(json.dumps, choices))}" if choices else ""


def _entries(table: Mapping[str, Any]) -> list[AugmentationEntry]:
    count, name = table.get("count", 1), table["name"]
    names = [f"{name}_{i + 1}" for i in range(count)] if "count" in table else [name]
    return [_entry(table, own, turn) for turn, own in enumerate(names)]


def _entry(table: Mapping[str, Any], name: str, turn: int) -> AugmentationEntry:
    """Return the augmentation `name`, for which what is listed to be taken in turn is taken for the `turn`th time, from
    0."""
    select = {
        group: chosen if isinstance(chosen, str) else chosen[turn % len(chosen)]
        for group, chosen in table.get("select", {}).items()
    }
    sample = {
        parameter: _fixed(words, turn) if words["distribution"] == IN_TURN else words
        for parameter, words in table.get("sample", {}).items()
    }
    constraints = dict(table.get("constraints", {}))
    return AugmentationEntry(name=name, select=select, sample=samples_of(sample), constraints=constraints)


def _fixed(words: Mapping[str, Any], turn: int) -> dict[str, Any]:
    """Return the words of a value taken in turn as those of a fixed one."""
    rest = {key: value for key, value in words.items() if key != "values"}
    return {**rest, "distribution": "fixed", "value": words["values"][turn % len(words["values"])]}


def _of_any(validator: Any, forms: Any, instance: Any, schema: Mapping[str, Any]) -> Iterator[ValidationError]:
    """Yield what is wrong with what fits none of the forms; of those that a key names, with the named one alone."""
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
