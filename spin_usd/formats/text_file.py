"""Text files of others, in whatever encoding their exporters chose."""

import codecs
from collections import Counter
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from spin_usd.basics.nesting import parsed_toml
from spin_usd.errors import InputError
from spin_usd.files.user_file import decoded, read_bytes

MAX_LINE = 2**24  # characters: a face of a million corners
UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def lines_of(path: Path, max_bytes: int) -> Iterator[str]:
    """Yield the lines of a text, read as `read_any_text` does. Raises as `lines_in`."""
    return lines_in(read_any_text(path, max_bytes), path)


def lines_in(text: str, path: Path) -> Iterator[str]:
    """Yield the lines of the text file at `path`. Raises InputError for a line longer than MAX_LINE, which no list or
    table has: parsing takes time by the length of lines."""
    for number, line in enumerate(text.splitlines(), 1):
        if len(line) > MAX_LINE:
            found = f"has {len(line)} characters, more than {MAX_LINE}"
            raise InputError(found, where=f"{path}, line {number}", do="look for line breaks that were lost")
        yield line


def is_finite(text: str) -> bool:
    """Return whether the text is a finite number."""
    try:
        return isfinite(float(text))
    except ValueError:
        return False


def line_at(text: str, place: int) -> int:
    """Return the line of a place in the text, from 1."""
    return text.count("\n", 0, place) + 1


def delimiter_of(head: str) -> str:
    """Return the separator of a table whose first line is `head`: the most frequent of comma, semicolon and tab."""
    return max(",;\t", key=head.count)


def headings_once(headings: Sequence[str] | None, where: object) -> None:
    """Raise InputError for a table with two columns of one heading: readers silently take the last. Numbers are not
    headings: a table without headings begins with them."""
    count = Counter(heading.strip() for heading in headings or ())
    if twice := [heading for heading in count if count[heading] > 1 and any(map(str.isalpha, heading))]:
        raise InputError(f"has the heading {twice[0]!r} twice", where=where, do="keep one of the columns")


def refuse_long_lines(data: bytes, path: Path) -> None:
    """Raise InputError if a line of the text in `data` has more than MAX_LINE bytes, before a library splits it."""
    start = 0
    while start + MAX_LINE < len(data):
        end = max(data.rfind(mark, start, start + MAX_LINE + 1) for mark in (b"\n", b"\r"))
        if end < 0:
            raise InputError(
                f"has a line of more than {MAX_LINE} bytes", where=path, do="look for line breaks that were lost"
            )
        start = end + 1


def read_any_text(path: Path, max_bytes: int) -> str:
    """Read the text of a file of at most `max_bytes`: UTF-16 if it has such a byte order mark, else UTF-8, or Latin-1
    if it is not valid UTF-8.

    Raises InputError for a file that cannot be read, or that is binary.
    """
    data = read_bytes(path, max_bytes)
    if data.startswith(UTF_16):
        return data.decode("utf-16", errors="replace")
    if b"\0" in data[:4096]:
        raise InputError("is not a text file", where=path, do="give one of the kinds that the option names")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def read_toml_file(path: Path, max_bytes: int) -> dict[str, Any]:
    """Read the tables of the file at `path`, of at most `max_bytes`. Raises InputError where it holds none."""
    return tables_in(read_bytes(path, max_bytes), path)


def tables_in(data: bytes, where: object) -> dict[str, Any]:
    """Return the tables in the `data` of a file. Raises InputError."""
    text = decoded(data, where)
    try:
        return parsed_toml(text)
    except ValueError as error:
        raise InputError(f"is not TOML: {error}", where=where, do="fix it there") from None
