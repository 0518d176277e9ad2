"""One parameter that can be sampled: its name, its units, its limits, and how it becomes a change of attributes."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NoReturn, TypeAlias

from spin_usd.errors import InputError
from spin_usd.stage.augment.attribute_change import AttributeChange, BaseStage
from spin_usd.stage.usd.values import FINITE, Range

NUMBER, DIRECTION, ATTITUDE, TRUTH, NAME, ANY = "number", "direction", "attitude", "truth", "name", "any"

UNITS: Mapping[str, Mapping[str, float]] = {
    "deg": {"deg": 1.0, "rad": 57.29577951308232},
    "W/m2": {"W/m2": 1.0, "kW/m2": 1e3},
    "K": {"K": 1.0},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "m": {"m": 1.0, "km": 1e3, "mm": 1e-3},
    "px": {"px": 1.0},
    "stops": {"stops": 1.0},
    "electrons": {"electrons": 1.0},
    "electrons/s": {"electrons/s": 1.0},
    "electrons/step": {"electrons/step": 1.0},
    "steps": {"steps": 1.0},
    "bits": {"bits": 1.0},
}
"""The units that a value can be given in, by the parameter's own unit, and how many of its own one of them is."""

LEAST = 1e-100  # length of a direction: its square is still a number

Maker: TypeAlias = Callable[[BaseStage, tuple[str, ...]], AttributeChange]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter that can be sampled."""

    name: str
    description: str
    make: Maker
    unit: str = ""
    """Its own; "" for plain numbers."""
    limits: Range = FINITE
    """Range of numbers, in that unit."""
    kind: str = NUMBER
    """The kind of value sampled."""
    group: str = ""
    """Group of the parameters that change the same attributes."""
    changes: bool = True
    """True if it can differ between pictures."""

    def factor(self, unit: str | None) -> float:
        """Return how many of the parameter's own units one `unit` is. Raises InputError at the parameter's name for a
        unit that is missing or not one of its units."""
        units = UNITS.get(self.unit, {})
        if unit is None and units:
            raise InputError("has no unit", where=self.name, do=f"give it unit = one of {', '.join(units)}")
        if unit is not None and unit not in units:
            do = f"use one of {', '.join(units)}" if units else "leave the unit out: it is a plain number"
            raise InputError(f"is given in {unit!r}", where=self.name, do=do)
        return units[unit] if unit is not None else 1.0

    def check(self, value: object) -> None:
        """Raise InputError at the parameter's name for a sampled value that it cannot have."""
        numbers = value if isinstance(value, tuple) else (value,)
        length = {DIRECTION: 3, ATTITUDE: 4}.get(self.kind)
        if length:
            fits = isinstance(value, tuple) and len(value) == length and all(_is_number(n) for n in value)
            fits = fits and LEAST < math.hypot(*numbers) < math.inf
        elif self.kind == NUMBER:
            fits = all(_is_number(n) for n in numbers)
        else:
            fits = self.kind == ANY or isinstance(value, {TRUTH: bool, NAME: str}[self.kind])
        if not fits:
            found = f"does not take {value!r}: it is a {self.kind}"
            raise InputError(found, where=self.name, do="sample values of that kind")
        if self.kind in (NUMBER, ANY):
            for number in filter(_is_number, numbers):
                if number not in self.limits:
                    self._refuse(f"{number:g}", self.limits)

    def check_span(self, low: float, high: float) -> None:
        """Raise InputError at the parameter's name where some number from `low` to `high` is not allowed."""
        limits = self.limits if low == high else replace(self.limits, or_0=False)
        if self.kind in (NUMBER, ANY) and not (low in limits and high in limits):
            self._refuse(f"{low:g} to {high:g}", limits)

    def _refuse(self, numbers: str, limits: Range) -> NoReturn:
        found = f"could be {numbers}{' ' * bool(self.unit)}{self.unit}"
        raise InputError(found, where=self.name, do=f"choose {limits}")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
