"""The distribution of a parameter, as a specification writes it, and the values sampled for all pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np
from msgspec import ValidationError, convert, structs
from msgspec.structs import FieldInfo

from spin_usd.basics.arrays import digest
from spin_usd.errors import InputError
from spin_usd.sampling.attitudes import Attitudes, AttitudesAround, Facing
from spin_usd.sampling.distribution import (
    Choice,
    Directions,
    Distribution,
    Fixed,
    LogUniform,
    Normal,
    Uniform,
    Value,
)

AnyDistribution = Fixed | Uniform | LogUniform | Normal | Choice | Directions | Attitudes | AttitudesAround | Facing
DISTRIBUTIONS: Mapping[str, type[Distribution]] = {
    str(each.__struct_config__.tag): each for each in get_args(AnyDistribution)
}
SCALED = ("value", "low", "high", "mean", "sigma", "values")
"""Fields that are in the parameter's unit."""


def distribution_of(words: Mapping[str, Any], factor: float = 1.0) -> Distribution:
    """Return the distribution that `words` name: {"distribution": its kind, and its fields}; its numbers are multiplied
    by `factor`, which brings them to the parameter's own unit. Raises InputError."""
    name = str(words.get("distribution"))
    if name not in DISTRIBUTIONS:
        raise InputError(f"there is no distribution {name!r}", do=f"choose one of {', '.join(DISTRIBUTIONS)}")
    fields = fields_of(DISTRIBUTIONS[name])
    required = [each.name for each in fields if each.required]
    for key in required:
        if key not in words:
            raise InputError(f"distribution {name} lacks {key!r}", do=f"give it {' and '.join(required)}")
    for key in words:
        if key not in ("distribution", *(each.name for each in fields)):
            known = ", ".join(each.name for each in fields) or "nothing else"
            raise InputError(f"distribution {name} has no {key!r}", do=f"it takes {known}")
    scaled = {key: _scaled(value, factor) if key in SCALED else value for key, value in words.items()}
    try:
        return convert(scaled, DISTRIBUTIONS[name])
    except ValidationError as error:
        if isinstance(error.__cause__, InputError):
            raise error.__cause__ from None
        raise InputError(f"distribution {name}: {error}", do="correct it") from None


def fields_of(kind: type[Distribution]) -> tuple[FieldInfo, ...]:
    """Return the values that a distribution of this kind accepts."""
    return tuple(each for each in structs.fields(kind) if each.name != "unit")


def _scaled(value: Any, factor: float) -> Any:
    """`value` with its numbers multiplied; truths and names stay."""
    if isinstance(value, list | tuple):
        return tuple(_scaled(each, factor) for each in value)
    if isinstance(value, bool | str) or factor == 1.0:
        return value
    return value * factor


Shared = Mapping[str, Sequence[str]]
"""For parameters shared by pictures: the owner of each picture's value, such as its sequence, instead of its name."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One parameter's distribution."""

    parameter: str
    distribution: Distribution
    per_frame: bool = False
    """True if sampled for each picture, False if once."""

    @property
    def stream(self) -> str:
        """The parameter whose random numbers it has: its own, or another's with which its values are chosen."""
        together = self.distribution.together if isinstance(self.distribution, Choice) else ""
        return together or self.parameter


@dataclass(frozen=True, kw_only=True)
class ParameterValues:
    """Sampled values by parameter: one value for all pictures, or one for each."""

    constant: Mapping[str, Value] = field(default_factory=dict)
    per_frame: Mapping[str, Sequence[Value]] = field(default_factory=dict)

    def __contains__(self, parameter: str) -> bool:
        return parameter in self.constant or parameter in self.per_frame

    def of(self, parameter: str) -> Sequence[Value]:
        """Return the parameter's values: one for each picture, or the only one."""
        return self.per_frame[parameter] if parameter in self.per_frame else (self.constant[parameter],)


def sample_all(
    samples: Sequence[Sample], *, seed: int, name: str, frames: Sequence[str], shared: Shared | None = None
) -> ParameterValues:
    """Sample the first values of all `samples` for the augmentation `name` of pictures named `frames`."""
    one = {s.parameter: sample_one(s, seed=seed, name=name) for s in samples if not s.per_frame}
    each = {}
    for sample in samples:
        if sample.per_frame:
            names = (shared or {}).get(sample.stream, frames)
            values = {own: sample_one(sample, seed=seed, name=name, frame=own) for own in dict.fromkeys(names)}
            each[sample.parameter] = [values[own] for own in names]
    return ParameterValues(constant=one, per_frame=each)


def sample_one(sample: Sample, *, seed: int, name: str, frame: str = "", again: int = 0) -> Value:
    """Sample the value of one sample for one picture, or for all where `frame` is "": a function of its arguments
    alone.

    again: how many values before this one did not meet their constraints. Raises InputError that names the parameter.
    """
    names = (name, sample.stream, frame, *([str(again)] if again else []))
    try:
        return sample.distribution.sample(stream(seed, *names))
    except InputError as error:
        raise InputError(error.found, where=sample.parameter, do=error.do) from None


def stream(seed: int, *names: str) -> np.random.Generator:
    """Return the generator for `names` (an augmentation, a parameter, a frame), the same on every machine.

    Adding, leaving out or reordering other things changes none of its numbers.
    """
    return np.random.Generator(np.random.Philox(key=int(digest([seed, *names])[:32], 16)))
