"""The YAML of calibrations: blocks, lists in brackets, numbers and words; also OpenCV's and ROS's.

It has no anchors and no multi-line texts; tags such as !!opencv-matrix are ignored. JSON is read as JSON.
"""

import re
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from spin_usd.basics.nesting import MAX_DEPTH
from spin_usd.errors import InputError
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.formats.json_file import read_json_file
from spin_usd.formats.text_file import lines_of

Lines = deque[tuple[int, str]]
"""The rest of a file: the indent of each line, and its text."""
QUOTED = r'"[^"]*"|\'[^\']*\''
KEY = re.compile(rf"({QUOTED}|[^\s\[\]{{}},#\"'-][^:]*?|-[^\s:][^:]*?)\s*:(?:\s+(.*))?$")
COMMENT = re.compile(r"(^|\s)#.*$")
TAG = re.compile(r"^!\S*\s*")
TOKEN = re.compile(rf"\s*([\[\]{{}},]|:(?=\s|$)|{QUOTED}|[^\[\]{{}},:\s](?:[^\[\]{{}},:]|:(?!\s))*)")


def read_yaml_file(path: Path) -> dict[str, Any]:
    """Return the contents of the file at `path`, by its keys. Raises InputError."""
    text = list(lines_of(path, MAX_SPECIFICATION))
    do = "write names and values, lists as [1, 2, 3]"
    if next((line for line in map(str.lstrip, text) if line), "").startswith(("{", "[")):
        found = read_json_file(path, MAX_SPECIFICATION)
    else:
        lines = _lines(text)
        try:
            found = _block(lines, 0) if lines else None
        except InputError as error:
            raise InputError(error.found, where=path, do=error.do) from None
        except (IndexError, ValueError):
            raise InputError("is not in the supported subset of YAML", where=path, do=do) from None
        if lines:
            raise InputError(f"is not in the supported subset of YAML, at {lines[0][1][:40]!r}", where=path, do=do)
    if not isinstance(found, dict):
        raise InputError("holds no names with values", where=path, do=do)
    return found


def _lines(text: list[str]) -> Lines:
    """Return the lines with content, without runs of blanks, which would slow the patterns; brackets joined on one
    line."""
    found: list[tuple[int, list[str]]] = []
    opened = 0
    for line in text:
        plain = COMMENT.sub("", line).rstrip()
        if not plain.strip() or plain.startswith(("%", "---", "...")):
            continue
        said = " ".join(plain.split())
        if opened > 0:
            found[-1][1].append(said)
        else:
            found.append((len(plain) - len(plain.lstrip()), [said]))
            opened = 0
        opened += sum(map(said.count, "[{")) - sum(map(said.count, "]}"))
    return deque((indent, " ".join(parts)) for indent, parts in found)


def _block(lines: Lines, depth: int) -> Any:
    """Take the next value off the lines. Raises ValueError where it is nested too deeply."""
    if depth > MAX_DEPTH:
        raise ValueError(depth)
    indent, text = lines[0]
    if _is_item(text):
        items = []
        while lines and lines[0][0] == indent and _is_item(lines[0][1]):
            _, text = lines.popleft()
            if rest := TAG.sub("", text[1:].lstrip()):
                lines.appendleft((indent + len(text) - len(rest), rest))
            items.append(_block(lines, depth + 1))
        return items
    if not KEY.match(text):
        return _value(deque(TOKEN.findall(lines.popleft()[1])), 0)
    found: dict[str, Any] = {}
    while lines and lines[0][0] == indent and (key := KEY.match(lines[0][1])):
        lines.popleft()
        name, rest = _new(key[1].strip("\"'"), found), TAG.sub("", key[2] or "")
        if rest:
            found[name] = _value(deque(TOKEN.findall(rest)), 0)
        elif lines and (lines[0][0] > indent or (lines[0][0] == indent and _is_item(lines[0][1]))):
            found[name] = _block(lines, depth + 1)
    return found


def _new(name: str, names: Mapping[str, Any]) -> str:
    """Return the name. Raises InputError where it is among the names already: readers take the last."""
    if name in names:
        raise InputError(f"has the key {name!r} twice in one place", do="keep one of them")
    return name


def _is_item(text: str) -> bool:
    return text == "-" or text.startswith("- ")


def _value(tokens: deque[str], depth: int) -> Any:
    """Take a number, a word, a list or names with values off the tokens. Raises IndexError or ValueError."""
    token = tokens.popleft()
    if token not in ("[", "{"):
        try:
            return float(token)
        except ValueError:
            return token.strip().strip("\"'")
    items: list[Any] = []
    named: dict[str, Any] = {}
    while tokens[0] not in ("]", "}"):
        item = _value(tokens, depth + 1) if depth < MAX_DEPTH else int("")
        if tokens[0] == ":":
            tokens.popleft()
            named[_new(str(item), named)] = _value(tokens, depth + 1)
        else:
            items.append(item)
        if tokens[0] == ",":
            tokens.popleft()
    tokens.popleft()
    return items if token == "[" else named
