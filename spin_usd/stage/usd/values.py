"""Values of attributes as numbers and arrays, and the refusal of those that an attribute must not have."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd

from spin_usd.arrays import Float
from spin_usd.errors import StageError
from spin_usd.scene.material import Limits

INFINITY = float("inf")


@dataclass(frozen=True)
class Range:
    """Finite numbers from `low` to `high`, without `low` itself where it is `open`; also 0 where that means "none"
    (`or_0`).

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
    value = typed_value(prim, name, time)
    numbers = (value,) if isinstance(value, int | float) else tuple(value)
    if not all(number in allowed for number in numbers):
        raise StageError(f"is {value}", where=f"{prim.GetPath()}.{name}", do=f"choose {allowed}")
    return value if isinstance(value, int | float) else numbers


def typed_value(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Any:
    """Read the value of an attribute of an applied schema. Raises StageError where it is not of the schema's type: USD
    returns whatever a layer authors."""
    attribute = prim.GetAttribute(name)
    value, kind = attribute.Get(time), attribute.GetTypeName()
    if type(value) is not type(kind.defaultValue):
        raise StageError(f"is {value!r}", where=attribute.GetPath(), do=f"make it a {kind}")
    return value


def refuse_unapplied(prim: Usd.Prim, prefix: str, api: str) -> None:
    """Raise StageError where `prim` authors attributes of an API schema that is not applied to it."""
    for attribute in prim.GetAuthoredAttributes():
        if attribute.GetName().startswith(prefix):
            raise StageError(f"is authored, but {api} is not applied", where=attribute.GetPath(), do="apply it")


def array(attribute: Usd.Attribute, time: Usd.TimeCode, dtype: type) -> Any:
    """Read an array attribute at `time`; empty where it has no value."""
    value = attribute.Get(time)
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
