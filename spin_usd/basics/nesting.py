"""JSON and TOML of bounded nesting: the only way to parse either.

Parsers call themselves for each level, and so does code that walks through their values. Python ends deep recursion
with a RecursionError, and takes minutes over a TOML key of many parts.
"""

import json
import re
import tomllib
from math import isfinite
from typing import Any, TypeVar

import numpy as np
from msgspec import convert

T = TypeVar("T")

MAX_DEPTH = 100  # levels; ten are many
CHUNK = 1 << 20  # bytes looked at together

STEPS = np.zeros(256, np.int8)
STEPS[list(b"[{")], STEPS[list(b"]}")] = 1, -1

_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_DEEP_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_DEPTH}}}")


class NestingError(ValueError):
    """Values in values, more levels of them than anything of use has."""

    def __init__(self) -> None:
        super().__init__(f"it is nested more than {MAX_DEPTH} deep")


def parsed_json(text: str | bytes, **hooks: Any) -> Any:
    """Return the JSON value in `text`; `hooks` are passed to json.loads. Raises ValueError, which NestingError is."""
    data = text.encode(errors="surrogatepass") if isinstance(text, str) else text
    if data.count(b"[") + data.count(b"{") > MAX_DEPTH and _depth(data) > MAX_DEPTH:
        raise NestingError
    return json.loads(text, **hooks)


def finite_json(text: str | bytes) -> Any:
    """Return the JSON value in `text`, which spin_usd wrote: its numbers are finite, for it could not be written again
    otherwise. Raises ValueError, which NestingError is."""
    return parsed_json(text, parse_constant=_finite, parse_float=_finite, parse_int=_integer)


def typed_json(text: str | bytes, type: type[T]) -> T:
    """Return the JSON value in `text`, which spin_usd wrote, as one of that type; fields that it does not name are
    passed over. Raises ValueError, also where the text is not of that type."""
    return convert(finite_json(text), type)


def parsed_toml(text: str) -> dict[str, Any]:
    """Return the TOML tables in `text`. Raises ValueError, which NestingError is."""
    if _DEEP_KEY.search(text):
        raise NestingError
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise NestingError from None


def _finite(text: str) -> float:
    if not isfinite(number := float(text)):
        raise ValueError(f"{text:.20} is not a finite number")
    return number


def _integer(text: str) -> int:
    _finite(text)
    return int(text)


def _depth(data: bytes) -> int:
    """Return how many brackets are open at most, but for those in strings."""
    plain = data.replace(rb"\\", b"..").replace(rb"\"", b"..")
    deepest = level = quotes = 0
    for start in range(0, len(plain), CHUNK):
        codes = np.frombuffer(plain, np.uint8, count=min(CHUNK, len(plain) - start), offset=start)
        seen = quotes + np.cumsum(codes == ord('"'))
        levels = level + np.cumsum(STEPS[codes] * (seen % 2 == 0), dtype=np.int64)
        deepest, level, quotes = max(deepest, int(levels.max())), int(levels[-1]), int(seen[-1])
    return deepest
