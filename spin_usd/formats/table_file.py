"""Small tables that a user writes by hand, of keypoints, parts or materials: JSON, CSV or TOML, one row for each name.

JSON and TOML: {name: [value, ...]} or {name: {column: value}}, or {name: value} where one is enough; JSON also [{key:
name, column: value}, ...]. CSV, with commas, semicolons or tabs: a line of headings, in any order.
"""

import csv
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spin_usd.basics.resources import bundled_names
from spin_usd.basics.suggestion import suggestion
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_TABLE
from spin_usd.files.user_file import read_text
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.text_file import delimiter_of, headings_once, lines_in, read_toml_file
from spin_usd.scene.derived.srgb import decode
from spin_usd.scene.keypoints import Keypoints
from spin_usd.scene.name_rule import KEEP, Color, MaterialRule, PartRule

SCALES = 1e-3, 1e3
HEXADECIMAL = re.compile("#[0-9A-Fa-f]{6}")


@dataclass(frozen=True, kw_only=True)
class Table:
    """The columns of a table: `key` heads its names, `required` and `optional` its other columns."""

    key: str
    required: tuple[str, ...]
    optional: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        return self.required + self.optional


KEYPOINTS = Table(key="name", required=("x", "y", "z"))
"""Points in the body's axes, metres."""
FINISH = ("material", "color", "scale")
PARTS = Table(key="pattern", required=("part",), optional=("class", *FINISH))
"""Parts, their classes and materials, by patterns of names."""
MATERIALS = Table(key="pattern", required=FINISH[:1], optional=(*FINISH[1:], "note"))
"""Materials of the library by patterns of names, with other colours, and other sizes of their patterns: factors."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """A row of a table."""

    where: str
    """Where it stands, for messages."""
    name: str
    values: Mapping[str, Any]
    """Values by column; those of a CSV file are text."""


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
            elif isinstance(entry, str) and len(table.required) == 1:
                entry = {table.required[0]: entry}
            yield f"{path}, {name!r}", {table.key: name, **entry} if isinstance(entry, dict) else entry
    else:
        raise InputError("holds no table", where=path, do=f"write {_shape(table, path)}")


def _row(where: str, raw: Any, table: Table, shape: str) -> Row:
    """`shape`: form of a row, for messages."""
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
    text = read_text(path, MAX_TABLE)
    delimiter = delimiter_of(text.partition("\n")[0])
    lines = csv.DictReader(lines_in(text, path), skipinitialspace=True, delimiter=delimiter, restkey="a further column")
    headings_once(lines.fieldnames, path)
    for row in lines:
        cells = {name: each.strip() if isinstance(each, str) else each for name, each in row.items()}
        yield f"{path}, line {lines.line_num}", cells


def read_keypoints_file(path: str | Path) -> Keypoints:
    """Read the keypoints of the file at `path`, in its order. Raises InputError that names the file and the row."""
    rows = read_table(path, KEYPOINTS)
    points = [[_metres(row, axis) for axis in KEYPOINTS.required] for row in rows]
    return Keypoints(names=tuple(row.name for row in rows), points=np.array(points, np.float64))


def _metres(row: Row, axis: str) -> float:
    number = _number(row.values[axis])
    if not math.isfinite(number):
        found = f"has {axis} = {row.values[axis]!r}"
        raise InputError(found, where=row.where, do="give finite numbers, metres in the body frame")
    return number


def _number(given: Any) -> float:
    """Return the given number, NaN for other text."""
    try:
        return math.nan if isinstance(given, bool) else float(given)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def read_parts_file(path: str | Path) -> tuple[PartRule, ...]:
    """Read the rules of the file at `path`, in its order; rules of one part have one class. Raises InputError that
    names the file and the row."""
    rows = read_table(path, PARTS)
    classes: dict[str, str] = {}
    for row in rows:
        part, given = _text(row, "part"), _text(row, "class") if "class" in row.values else None
        if given is not None and classes.setdefault(part, given) != given:
            found = f"gives the part {part!r} the class {given!r}, and another row gives it {classes[part]!r}"
            raise InputError(found, where=row.where, do="give one part one class")
    names = [(row.name, _text(row, "part")) for row in rows]
    return tuple(PartRule(pattern=pattern, part=part, class_name=classes.get(part)) for pattern, part in names)


def read_materials_file(path: str | Path, table: Table = MATERIALS) -> tuple[MaterialRule, ...]:
    """Read the rules for materials of the file at `path`, in its order, from the rows that name a material. Raises
    InputError that names the file and the row."""
    rows = read_table(path, table)
    for row in rows:
        idle = [column for column in FINISH[1:] if column in row.values]
        if idle and row.values.get("material", KEEP) == KEEP:
            do = "name a material of the library, or leave it out"
            raise InputError(f"has a {idle[0]}, but no material to apply it to", where=row.where, do=do)
    return tuple(_material(row) for row in rows if "material" in row.values)


def _material(row: Row) -> MaterialRule:
    name, known = _text(row, "material"), (*bundled_names("material"), KEEP)
    if name not in known:
        do = suggestion(name, known, "see spin-usd list materials")
        raise InputError(f"there is no material {name!r}", where=row.where, do=do)
    return MaterialRule(
        pattern=row.name,
        material=name,
        color=_color(row) if "color" in row.values else None,
        scale=_scale(row) if "scale" in row.values else 1.0,
    )


def _color(row: Row) -> Color:
    """Read a colour: three numbers, as a list or in a text, linear Rec. 709; or #rrggbb, which is sRGB."""
    given: Any = row.values["color"]
    if isinstance(given, str) and HEXADECIMAL.fullmatch(given):
        numbers = decode(np.frombuffer(bytes.fromhex(given[1:]), np.uint8) / 255).tolist()
    else:
        each_given = given.split() if isinstance(given, str) else given if isinstance(given, list) else ()
        numbers = [_number(each) for each in each_given]
    if len(numbers) != 3 or not all(0 <= each <= 1 for each in numbers):
        do = "give three numbers of 0 to 1, linear, such as 0.8 0.6 0.2, or #rrggbb"
        raise InputError(f"has color = {given!r}", where=row.where, do=do)
    return numbers[0], numbers[1], numbers[2]


def _scale(row: Row) -> float:
    number = _number(row.values["scale"])
    if not SCALES[0] <= number <= SCALES[1]:
        do = f"give a factor on the size of its pattern, {SCALES[0]:g} to {SCALES[1]:g}"
        raise InputError(f"has scale = {row.values['scale']!r}", where=row.where, do=do)
    return number


def _text(row: Row, column: str) -> str:
    given = row.values[column]
    if not isinstance(given, str) or not given.isprintable() or len(given) > 255:
        raise InputError(
            f"has the {column} {given!r}", where=row.where, do="give printable text of up to 255 characters"
        )
    return given
