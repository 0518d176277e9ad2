"""Small tables that a user writes by hand: JSON, CSV or TOML, one row for each name.

JSON and TOML: {name: [value, ...]} or {name: {column: value}}; JSON also [{key: name, column: value}, ...]. CSV: a line
of headings, in any order.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_TABLE
from spin_usd.files.user_file import read_text
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.text_file import lines_in
from spin_usd.formats.toml_file import read_toml_file


@dataclass(frozen=True, kw_only=True)
class Table:
    """The columns of a table: `key` heads its names, `required` and `optional` its other columns."""

    key: str
    required: tuple[str, ...]
    optional: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        return self.required + self.optional


@dataclass(frozen=True, kw_only=True)
class Row:
    """`where` it stands, for messages · `name` · `values` by column: those of a CSV file are text."""

    where: str
    name: str
    values: Mapping[str, Any]


def read_table(path: str | Path, table: Table) -> tuple[Row, ...]:
    """Read the rows of the file at `path`. Raises InputError that names the file and the row at fault."""
    path = Path(path)
    rows = tuple(_row(where, raw, table, _shape(table, path)) for where, raw in _raw_rows(path, table))
    if not rows:
        raise InputError(f"holds no {table.key}", where=path, do=f"give at least one row: {_shape(table, path)}")
    names = [row.name for row in rows]
    for i, row in enumerate(rows):
        if row.name in names[:i]:
            raise InputError(f"names {row.name!r} a second time", where=row.where, do="keep one of them")
    return rows


def _raw_rows(path: Path, table: Table) -> Iterable[tuple[str, Any]]:
    match path.suffix.lower():
        case ".json":
            return _structured(read_json_file(path, MAX_TABLE), path, table)
        case ".toml":
            return _structured(read_toml_file(path, MAX_TABLE), path, table)
        case ".csv":
            return _read_csv(path)
    raise InputError("is neither .json, .csv nor .toml", where=path, do="give one of those")


def _structured(document: Any, path: Path, table: Table) -> Iterator[tuple[str, Any]]:
    if isinstance(document, list):
        yield from ((f"{path}, entry {i}", entry) for i, entry in enumerate(document))
    elif isinstance(document, dict):
        for name, entry in document.items():
            if isinstance(entry, list) and len(table.required) <= len(entry) <= len(table.columns):
                entry = dict(zip(table.columns, entry, strict=False))
            yield f"{path}, {name!r}", {table.key: name, **entry} if isinstance(entry, dict) else entry
    else:
        raise InputError("holds no table", where=path, do=f"write {_shape(table, path)}")


def _row(where: str, raw: Any, table: Table, shape: str) -> Row:
    """`shape`: what a row looks like, for messages."""
    columns = (table.key, *table.columns)
    if not isinstance(raw, dict):
        raise InputError(f"is not a row of {', '.join(table.columns)}", where=where, do=f"write {shape}")
    if missing := [name for name in (table.key, *table.required) if raw.get(name) in (None, "")]:
        raise InputError(f"has no {missing[0]!r}", where=where, do=f"give each row {', '.join(columns)}")
    if unknown := [name for name in raw if name not in columns]:
        raise InputError(
            f"has {unknown[0]!r}, which means nothing here", where=where, do=f"keep to {', '.join(columns)}"
        )
    name = raw[table.key]
    if not isinstance(name, str) or not name.isprintable() or name != name.strip():
        raise InputError(
            f"has the {table.key} {name!r}", where=where, do="give printable text without blanks around it"
        )
    values = {column: raw[column] for column in table.columns if raw.get(column) not in (None, "")}
    return Row(where=where, name=name, values=values)


def _shape(table: Table, path: Path) -> str:
    """Return a description of a row in the file at `path`."""
    key, columns = table.key.upper(), ", ".join(table.columns)
    if path.suffix.lower() == ".toml":
        return f'"{key}" = [{columns}], one such line for each {table.key}'
    return f'{{"{key}": [{columns}], ...}}, or CSV with these as headings'


def _read_csv(path: Path) -> Iterator[tuple[str, Any]]:
    lines = csv.DictReader(
        lines_in(read_text(path, MAX_TABLE), path), skipinitialspace=True, restkey="a further column"
    )
    headings = lines.fieldnames or ()
    if len(headings) == 1 and (other := next((mark for mark in (";", "\t") if mark in headings[0]), None)):
        raise InputError(f"has {other!r} between its columns", where=path, do="put commas between them")
    for row in lines:
        text = {name: each.strip() if isinstance(each, str) else each for name, each in row.items()}
        yield f"{path}, line {lines.line_num}", text
