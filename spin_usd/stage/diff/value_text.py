"""Values of attributes as short text, different wherever the values are."""

from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd

from spin_usd.stage.composition.stage_hash import asset_sha256

MAX_CHARACTERS = 72  # characters of one value
FIRST = 4  # numbers of an array that are shown
DIGITS = 12  # of a digest


def value_texts(a: Any, b: Any, attribute: Usd.Attribute) -> tuple[str | None, str | None]:
    """Return two differing values of `attribute` as text, each in at most MAX_CHARACTERS characters and None for None;
    files with the beginning of their digest, arrays from where they differ if they begin alike."""
    name = str(attribute.GetTypeName().cppTypeName).removeprefix("VtArray<").removesuffix(">")
    single = name == "float" or name[-1:] in "fh"
    first, second = (None if value is None else _text(value, single=single) for value in (a, b))
    if first == second and hasattr(a, "__len__") and len(a) == len(b):
        at = next(i for i, (x, y) in enumerate(zip(a, b, strict=True)) if not same_value(x, y))
        first, second = (f"[at {at}: {_text(v[at], single=single)}, {len(v)} in all]" for v in (a, b))
    return _cut(first), _cut(second)


def _cut(text: str | None) -> str | None:
    return text if text is None or len(text) <= MAX_CHARACTERS else f"{text[: MAX_CHARACTERS - 1]}…"


def same_value(a: Any, b: Any) -> bool:
    """Return whether two values are the same; assets are where they resolve to the same file."""
    if isinstance(a, Sdf.AssetPath) and isinstance(b, Sdf.AssetPath):
        return bool((a.resolvedPath or a.path) == (b.resolvedPath or b.path))
    if isinstance(a, Sdf.AssetPathArray) and isinstance(b, Sdf.AssetPathArray):
        return len(a) == len(b) and all(same_value(x, y) for x, y in zip(a, b, strict=True))
    return bool(a == b)


def _text(value: Any, *, single: bool) -> str:
    match value:
        case bool():
            return str(value).lower()
        case float():
            return str(np.float32(value)) if single else repr(value)
        case str():
            return f'"{value}"'
        case Sdf.AssetPath():
            file = f" {asset_sha256(value.resolvedPath)[:DIGITS]}" if value.resolvedPath else ""
            return f"@{value.path}@{file}"
        case Gf.Quatd() | Gf.Quatf() | Gf.Quath():
            return _text((value.real, *value.imaginary), single=single)
    if not hasattr(value, "__len__"):
        return str(value)
    first = ", ".join(_text(item, single=single) for item in list(value[:FIRST]))
    if type(value).__module__.endswith("Gf") or isinstance(value, tuple):
        return f"({', '.join(_text(item, single=single) for item in value)})"
    return f"[{first}]" if len(value) <= FIRST else f"[{first}, … {len(value)} in all]"
