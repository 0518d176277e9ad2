"""Values of attributes as numbers and arrays, and the refusal of invalid ones."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd

from spin_usd.basics.arrays import Float
from spin_usd.errors import StageError
from spin_usd.scene.material import Limits

INFINITY = float("inf")
TYPES = Sdf.ValueTypeNames
TEXT, TEXTS = (TYPES.String, TYPES.Token), (TYPES.StringArray, TYPES.TokenArray)
WHOLE, VECTORS = (TYPES.Int, TYPES.Int64), (TYPES.Double3Array, TYPES.Float3Array, TYPES.Half3Array)
"""Types of attributes that a prim may have without their schema."""
QUATERNIONS = ({Gf.Quatd}, {Gf.Quatf}, {Gf.Quath})
DEFAULT_TIME = Usd.TimeCode.Default()
MAX_SHOWN = 60  # characters of a wrong value in a message


@dataclass(frozen=True)
class Range:
    """Finite numbers from `low` to `high`, excluding `low` if `open`; also 0 if that means "none" (`or_0`).

    A range includes all real cameras, lamps and surfaces, and ends well before float32 overflows.
    """

    low: float = -INFINITY
    high: float = INFINITY
    open: bool = False
    or_0: bool = False

    def __contains__(self, number: float) -> bool:
        if self.or_0 and number == 0:
            return True
        return bool(np.isfinite(number) and self.low <= number <= self.high and not (self.open and number == self.low))

    @property
    def minimum(self) -> float:
        """The lowest number in the range, apart from the 0 that means "none"."""
        return float(np.nextafter(self.low, INFINITY)) if self.open else self.low

    def __str__(self) -> str:
        if self.low == -INFINITY:
            return "finite numbers"
        if self.high == INFINITY:
            return f"numbers above {self.low:g}" if self.open else f"numbers from {self.low:g} up"
        numbers = f"numbers from {self.low:g} to {self.high:g}"
        if self.open:
            numbers = f"numbers above {self.low:g}, to {self.high:g}"
        return f"0, or {numbers}" if self.or_0 else numbers


FINITE, AT_LEAST_0, ABOVE_0, SHARE = Range(), Range(0), Range(0, open=True), Range(0, 1)


def value_in(prim: Usd.Prim, name: str, allowed: Range, time: Usd.TimeCode) -> Any:
    """Read the number, or tuple of numbers, of the attribute `name`. Raises StageError where one is outside
    `allowed`."""
    value = _typed(prim.GetAttribute(name), time, ())
    if value is None:
        raise StageError("has no value", where=f"{prim.GetPath()}.{name}", do=f"choose {allowed}")
    numbers = (value,) if isinstance(value, int | float) else tuple(value)
    if not all(number in allowed for number in numbers):
        raise StageError(f"is {value}", where=f"{prim.GetPath()}.{name}", do=f"choose {allowed}")
    return value if isinstance(value, int | float) else numbers


def typed_value(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Any:
    """Read the value of an attribute of an applied schema, which has a fallback. Raises StageError where it has no
    value of the schema's type."""
    attribute = prim.GetAttribute(name)
    value = read(attribute, time)
    if value is None:
        raise StageError("has no value", where=f"{prim.GetPath()}.{name}", do="author one, or apply its schema")
    return value


def read(attribute: Usd.Attribute, time: Usd.TimeCode = DEFAULT_TIME, *types: Sdf.ValueTypeName) -> Any:
    """Read the value of `attribute` at `time`; None if there is no such attribute, or no value.

    USD returns whatever a layer authors, of any type. Raises StageError unless the value is of one of `types`, by
    default the attribute's own, and its numbers are finite. All values of stages are read by this function or by
    `read_samples`.
    """
    value = _typed(attribute, time, types)
    if value is not None:
        _check_finite(attribute, value)
    return value


def read_samples(attribute: Usd.Attribute, *types: Sdf.ValueTypeName) -> list[tuple[float, Any]]:
    """Read all time samples, as (time code, value), of values as `read` gives them. Raises as `read`."""
    query = Usd.AttributeQuery(attribute)  # resolves the source of the values only once
    found = [(float(time), query.Get(time)) for time in query.GetTimeSamples()]
    there = [(time, value) for time, value in found if value is not None]
    _check_samples(attribute, [value for _, value in there], types)
    return there


def read_all(attribute: Usd.Attribute, *types: Sdf.ValueTypeName) -> list[Any]:
    """Read all values that `attribute` has at any time: its samples', else its default's. Raises as `read`."""
    values = [value for _, value in read_samples(attribute, *types)]
    default = None if values else read(attribute, DEFAULT_TIME, *types)
    return values if default is None else [default]


def read_any(attribute: Usd.Attribute, time: Usd.TimeCode = DEFAULT_TIME) -> Any:
    """Read a value that may be of any type that USD knows, as `read`."""
    value = attribute.Get(time) if attribute else None
    if isinstance(value, Sdf.UnregisteredValue):
        found = f"is {_shown(value)}, of a type unknown to USD"
        raise StageError(found, where=attribute.GetPath(), do="author it with a type that USD knows")
    if value is not None:
        _check_finite(attribute, value)
    return value


def _typed(attribute: Usd.Attribute, time: Usd.TimeCode, types: tuple[Sdf.ValueTypeName, ...]) -> Any:
    value = attribute.Get(time) if attribute else None
    if value is not None:
        _check_type(attribute, value, types)
    return value


def _check_samples(attribute: Usd.Attribute, values: Sequence[Any], types: tuple[Sdf.ValueTypeName, ...]) -> None:
    """Raise the errors of `_check_type` and `_check_finite` for each value. If all are finite numbers, quaternions, or
    arbitrary text, only the first is checked: a stage may have a million."""
    kinds = {type(value) for value in values}
    numbers = kinds == {float} and np.isfinite(values).all()
    text = kinds == {str} and not attribute.GetMetadata("allowedTokens")
    for value in values[:1] if numbers or text or kinds in QUATERNIONS else values:
        _check_type(attribute, value, types)
        _check_finite(attribute, value)


def _check_type(attribute: Usd.Attribute, value: Any, types: tuple[Sdf.ValueTypeName, ...]) -> None:
    expected = types or (attribute.GetTypeName(),)
    if not any(type(value) is type(each.defaultValue) for each in expected):
        do = f"make it a {' or '.join(map(str, expected))}" if expected[0] else "author it with a type that USD knows"
        raise StageError(f"is {_shown(value)}", where=attribute.GetPath(), do=do)
    if isinstance(value, str):
        _check_token(value, attribute.GetMetadata("allowedTokens"), attribute.GetPath())


def _check_token(value: str, allowed: Sequence[str] | None, where: object) -> None:
    """Raise StageError unless `value` is one of the values that its schema allows, if it lists any."""
    if allowed and value not in allowed:
        shown = ", ".join(token or "''" for token in allowed)
        raise StageError(f"is {_shown(value)}", where=where, do=f"choose one of {shown}")


def _check_finite(attribute: Usd.Attribute, value: Any) -> None:
    """Raise StageError for NaN and infinity. Quaternions have no numpy type; their norms are checked elsewhere."""
    if isinstance(value, str | int | Sdf.AssetPath | Gf.Quatd | Gf.Quatf | Gf.Quath):
        return
    numbers = np.array(value)
    if numbers.dtype.kind != "f" or np.isfinite(numbers).all():
        return
    if not attribute.GetTypeName().isArray:
        raise StageError(f"is {value}", where=attribute.GetPath(), do="make it finite")
    i = int(np.argmin(np.isfinite(numbers.reshape(len(numbers), -1)).all(1)))
    found = f"{attribute.GetName()}[{i}] is {numbers[i]}, but its numbers must be finite"
    raise StageError(found, where=attribute.GetPrim().GetPath(), do="fix it")


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 1]}…"


def refuse_unapplied(prim: Usd.Prim, prefix: str, api: str) -> None:
    """Raise StageError where `prim` has values of attributes of an API schema that is not applied to it."""
    for attribute in prim.GetAuthoredAttributes():
        if attribute.GetName().startswith(prefix) and attribute.HasAuthoredValue():
            raise StageError(f"is authored, but {api} is not applied", where=attribute.GetPath(), do="apply it")


def array(attribute: Usd.Attribute, time: Usd.TimeCode, dtype: type) -> Any:
    """Read an array attribute at `time`; empty where it has no value."""
    value = read(attribute, time)
    return np.zeros(0, dtype) if value is None else np.array(value, dtype)


def refuse(bad: Any, name: str, values: Any, why: str, where: Any) -> None:
    """Raise StageError for the first of `values` (N, ...) that is `bad` (N,)."""
    if bad.any():
        i = int(np.argmax(bad))
        raise StageError(f"{name}[{i}] is {values[i]}, but {why}", where=where, do="fix the mesh")


def refuse_outside(values: Float, limits: Limits, where: object, source: str = "") -> None:
    """Raise StageError where one of `values`, which the input gets from `source`, is outside its limits."""
    wrong = ~((values >= limits.low) & (values <= limits.high))
    if not wrong.any():
        return
    by = f", by {source}" if source else ""
    do = f"keep it between {limits.low:g} and {limits.high:g}"
    raise StageError(f"its {limits.name} is {np.asarray(values)[wrong][0]:g}{by}", where=where, do=do)
