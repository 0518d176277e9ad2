"""Index files: JSON, CSV or text that lists many pictures, written a row at a time.

Numbers are written with all their digits: they come back as the same doubles.
"""

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Section:
    """One list of an index: the text before its rows, between two of them, and after them."""

    before: str = ""
    between: str = ""
    after: str = ""


@dataclass(frozen=True, kw_only=True)
class IndexFile:
    """A style of index: the text of a row's value, and the sections by name, in their order in the file."""

    text: Callable[[Any], str]
    sections: Mapping[str, Section]


def json_list() -> IndexFile:
    """A JSON list; a row is an element."""
    return IndexFile(text=json_text, sections={"": Section(before="[\n", between=",\n", after="\n]\n")})


def json_object() -> IndexFile:
    """A JSON object; a row is (key, value)."""
    return IndexFile(text=_member, sections={"": Section(before="{\n", between=",\n", after="\n}\n")})


def json_lists(head: Mapping[str, Any], names: Sequence[str]) -> IndexFile:
    """A JSON object with the members of `head`, then lists of these names; a row is an element of its section."""
    before = "".join(f"{_member(member)},\n" for member in head.items())
    openings = [("{\n" + before if i == 0 else "") + f"{json_text(name)}: [\n" for i, name in enumerate(names)]
    closings = [*["\n],\n"] * (len(names) - 1), "\n]\n}\n"]
    made = (Section(before=first, between=",\n", after=last) for first, last in zip(openings, closings, strict=True))
    return IndexFile(text=json_text, sections=dict(zip(names, made, strict=True)))


def csv_table(columns: Sequence[str] = ()) -> IndexFile:
    """A CSV table with a line of headings, if there are any; a row is a sequence of values."""
    return IndexFile(text=csv_line, sections={"": Section(before=csv_line(columns) if columns else "")})


def text_lines(head: str = "") -> IndexFile:
    """The text `head`, then rows, each a line of text or several."""
    return IndexFile(text=lambda line: f"{line}\n", sections={"": Section(before=head)})


def json_text(value: Any) -> str:
    """Return the value as JSON on one line; NaN and infinity raise ValueError, as JSON has none."""
    return json.dumps(value, allow_nan=False)


def write_json_file(value: Any) -> Callable[[Path], None]:
    """Return a function that writes the value as indented JSON, for a MadeFile."""
    text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    return lambda path: _write(path, text)


def write_text_file(text: str) -> Callable[[Path], None]:
    """Return a function that writes the text as UTF-8, for a MadeFile."""
    return lambda path: _write(path, text)


def csv_line(values: Sequence[Any]) -> str:
    """Return the values as a line of CSV, numbers with all their digits."""
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(float(each) if isinstance(each, float) else each for each in values)
    return line.getvalue()


def _member(member: tuple[str, Any]) -> str:
    key, value = member
    return f"{json_text(key)}: {json_text(value)}"


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
