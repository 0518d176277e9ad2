"""Numbers of prims that must lie in a range."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd

from spin_usd.errors import StageError

INFINITY = float("inf")


@dataclass(frozen=True)
class Range:
    """Finite numbers from `low` to `high`; without `low` itself where it is `open`."""

    low: float = -INFINITY
    high: float = INFINITY
    open: bool = False

    def __contains__(self, number: float) -> bool:
        return bool(np.isfinite(number) and self.low <= number <= self.high and not (self.open and number == self.low))

    def __str__(self) -> str:
        if self.low == -INFINITY:
            return "finite numbers"
        if self.high == INFINITY:
            return f"numbers above {self.low:g}" if self.open else f"numbers from {self.low:g} up"
        return f"numbers from {self.low:g} to {self.high:g}"


FINITE, AT_LEAST_0, ABOVE_0, SHARE = Range(), Range(0), Range(0, open=True), Range(0, 1)


def value_in(prim: Usd.Prim, name: str, allowed: Range, time: Usd.TimeCode) -> Any:
    """The number, or tuple of numbers, of the attribute `name`. Raises StageError where one is outside of `allowed`."""
    value = prim.GetAttribute(name).Get(time)
    where = f"{prim.GetPath()}.{name}"
    if value is None:
        raise StageError("has no value", where=where, do=f"choose {allowed}")
    numbers = (value,) if isinstance(value, int | float) else tuple(value)
    if not all(number in allowed for number in numbers):
        raise StageError(f"is {value}", where=where, do=f"choose {allowed}")
    return value if isinstance(value, int | float) else numbers


def refuse_unapplied(prim: Usd.Prim, prefix: str, api: str) -> None:
    """Raise StageError where `prim` authors attributes of an API schema that is not applied to it."""
    for attribute in prim.GetAuthoredAttributes():
        if attribute.GetName().startswith(prefix):
            raise StageError(f"is authored, but {api} is not applied", where=attribute.GetPath(), do="apply it")
