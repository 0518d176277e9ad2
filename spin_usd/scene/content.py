"""The content of any frozen value of the scene as JSON: all that decides a picture, without names.

Fields marked NAME (prim paths, for messages) do not count; arrays and images count by their digests.
"""

from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from spin_usd.basics.arrays import digest

NAME = {"name": True}
"""Metadata of a dataclass field that no picture depends on."""
ADDED = {"added": True}
"""Metadata of a dataclass field that came later: its default does not count, so that earlier keys stay."""

PLAIN = frozenset((str, int, float, bool, type(None)))  # most values: they are recognised first


def key_of(value: Any) -> str:
    """sha256 (hex) of the content of `value`."""
    return digest(content(value))


def content(value: Any) -> Any:
    """`value` as JSON: dataclasses by type and field, arrays by digest, anything with a `key` or `digested` values by
    those."""
    if type(value) in PLAIN:
        return value
    if isinstance(value, (tuple, list)):
        return [content(item) for item in value]
    if isinstance(value, np.ndarray):
        return digest(value)
    if isinstance(key := getattr(value, "key", None), str):
        return key
    if isinstance(own := getattr(value, "digested", None), dict):
        return {name: content(item) for name, item in own.items()}
    if is_dataclass(value):
        kind: Any = type(value)
        counted = {name: content(getattr(value, name)) for name in _counted(kind)}
        for name, default in _added(kind).items():
            if counted[name] == default:
                del counted[name]
        return {"": kind.__name__, **counted}
    if isinstance(value, (set, frozenset)):
        return sorted(content(item) for item in value)
    if isinstance(value, Enum):
        return value.value
    return value


@cache
def _counted(kind: Any) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass that count."""
    return tuple(f.name for f in fields(kind) if not f.metadata.get("name"))


@cache
def _added(kind: Any) -> dict[str, Any]:
    """Return the defaults of the fields of a dataclass that came later."""
    return {f.name: f.default for f in fields(kind) if f.metadata.get("added")}
