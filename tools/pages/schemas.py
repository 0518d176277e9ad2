"""The reference of the documents: each JSON schema as a table of its fields, and the USD schema of stages."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pages.markdown import cell, table
from pxr import Sdf

SCHEMAS = Path(__file__).resolve().parents[2] / "schemas"
INTRODUCTION = """# Schemas

JSON documents name their schema in `schema`, such as `record-1`. The number changes when a reader of the old form would
misread the new one. A field's path has `[]` for each entry of a list and `*` for any name.
"""
Row = tuple[str, str, str]
HEAD = ("field", "type", "meaning")
STAGE = """## The stage: USD

API schemas that a stage's prims have; `python -m spin_usd.plugin_path` prints the folder that usdview needs to know
them.
"""


def page() -> str:
    """Return the page, in Markdown."""
    documents = (line for path in sorted(SCHEMAS.glob("*.json")) for line in _document(path))
    return "\n".join((INTRODUCTION, *documents, STAGE, *_usd(SCHEMAS / "spin" / "generatedSchema.usda")))


def _document(path: Path) -> Iterator[str]:
    schema = json.loads(path.read_text())
    yield f"## {path.name.removesuffix('.schema.json')}\n\n{cell(schema['title'])}.\n"
    if "description" in schema:
        yield f"{cell(schema['description'])}\n"
    yield f"{table(HEAD, _fields('', schema))}\n"
    for name, shared in schema.get("$defs", {}).items():
        yield f"### {path.name.removesuffix('.schema.json')}: {name}\n\n{cell(shared.get('description', ''))}\n"
        yield f"{table(HEAD, _rows('', shared, ''))}\n"


def _fields(path: str, schema: dict[str, Any]) -> Iterator[Row]:
    """Yield a row for each field below the schema, and below its fields."""
    needed = schema.get("required", ())
    for name, inner in schema.get("properties", {}).items():
        yield from _rows(f"{path}.{name}".lstrip("."), inner, "" if name in needed else "optional")
    for name, inner in schema.get("patternProperties", {}).items():
        yield from _rows(f"{path}.{name}".lstrip("."), inner, "")
    if isinstance(any_name := schema.get("additionalProperties"), dict):
        yield from _rows(f"{path}.*".lstrip("."), any_name, "")


def _rows(path: str, schema: dict[str, Any], optional: str) -> Iterator[Row]:
    """Yield the field's row, and those of what it holds."""
    kind = ", ".join(filter(None, (_type(schema), *_limits(schema), optional)))
    yield f"`{path}`" if path else "", cell(kind), cell(schema.get("description", ""))
    yield from _fields(path, schema)
    items = schema.get("items")
    if isinstance(items, dict) and ("properties" in items or "description" in items):
        yield from _rows(f"{path}[]", items, "")


def _type(schema: dict[str, Any]) -> str:
    for key in ("oneOf", "anyOf"):
        if key in schema:
            return " or ".join(dict.fromkeys(_type(each) for each in schema[key]))
    if "$ref" in schema:
        return str(schema["$ref"]).rpartition("/")[2]
    if "const" in schema:
        return json.dumps(schema["const"])
    if "enum" in schema:
        return " or ".join(map(json.dumps, schema["enum"]))
    kind = schema.get("type", "any")
    name = " or ".join(kind) if isinstance(kind, list) else str(kind)
    items = schema.get("items")
    return f"{name} of {_type(items)}" if isinstance(items, dict) and "properties" not in items else name


def _limits(schema: dict[str, Any]) -> Iterator[str]:
    words = {"minimum": "from", "exclusiveMinimum": "above", "maximum": "to", "exclusiveMaximum": "below"}
    numbers = [f"{word} {schema[key]:g}" for key, word in words.items() if key in schema]
    least, most = schema.get("minItems"), schema.get("maxItems")
    if numbers:
        yield " ".join(numbers)
    if least is not None or most is not None:
        yield f"{least} of them" if least == most else f"{least or 0} or more of them"


def _usd(path: Path) -> Iterator[str]:
    layer = Sdf.Layer.FindOrOpen(str(path))
    for prim in layer.rootPrims:
        yield f"### {prim.name}\n\n{cell(prim.documentation or '')}\n"
        attributes = (each for each in prim.properties if isinstance(each, Sdf.AttributeSpec))
        yield f"{table(('attribute', 'type, default', 'meaning'), map(_attribute, attributes))}\n"


def _attribute(attribute: Sdf.AttributeSpec) -> Row:
    default = "" if attribute.default is None else f", {attribute.default}"
    return f"`{attribute.name}`", cell(f"{attribute.typeName}{default}"), cell(attribute.documentation or "")
