"""Numbers of prims that must lie in a range."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd

from spin_usd.errors import StageError

INFINITY = float("inf")


@dataclass(frozen=True)
class Range:
    """Finite numbers from `low` to `high`, without `low` itself where it is `open`; and 0 where it means none (`or_0`).

    A range ends where no real camera, lamp or surface lies any more, and well before float32 does.
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
    def least(self) -> float:
        """The lowest number in it, but for the 0 that means none."""
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
    """The number, or tuple of numbers, of the attribute `name`. Raises StageError where one is outside of `allowed`."""
    value = typed_value(prim, name, time)
    numbers = (value,) if isinstance(value, int | float) else tuple(value)
    if not all(number in allowed for number in numbers):
        raise StageError(f"is {value}", where=f"{prim.GetPath()}.{name}", do=f"choose {allowed}")
    return value if isinstance(value, int | float) else numbers


def typed_value(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Any:
    """The value of an attribute of an applied schema. Raises StageError where it is not of the schema's type: USD hands
    out what a layer says."""
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
