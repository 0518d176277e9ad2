"""The distribution of a parameter, as a specification writes it, and the values sampled for all pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

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
from spin_usd.sampling.stream import stream


@dataclass(frozen=True, kw_only=True)
class DistributionKind:
    """A distribution as its words name it: `numbers` are in the parameter's unit, `required` must be there."""

    make: type[Any]
    required: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()

    @property
    def fields(self) -> tuple[str, ...]:
        return self.required + self.optional


BOUNDS = ("low", "high")
KINDS: Mapping[str, DistributionKind] = {
    "fixed": DistributionKind(make=Fixed, required=("value",), numbers=("value",)),
    "uniform": DistributionKind(make=Uniform, required=BOUNDS, numbers=BOUNDS),
    "log_uniform": DistributionKind(make=LogUniform, required=BOUNDS, numbers=BOUNDS),
    "normal": DistributionKind(
        make=Normal, required=("mean", "sigma"), optional=BOUNDS, numbers=("mean", "sigma", *BOUNDS)
    ),
    "choice": DistributionKind(make=Choice, required=("values",), optional=("weights",), numbers=("values",)),
    "directions": DistributionKind(make=Directions, optional=("axis", "least", "most")),
    "attitudes": DistributionKind(make=Attitudes),
    "attitudes_around": DistributionKind(make=AttitudesAround, required=("around", "most")),
    "facing": DistributionKind(make=Facing, required=("axis", "most"), optional=("towards", "least")),
}


def distribution_of(words: Mapping[str, Any], factor: float = 1.0) -> Distribution:
    """Return the distribution that `words` name: {"distribution": its kind, and its fields}; its numbers are multiplied
    by `factor`, which brings them to the parameter's own unit. Raises InputError."""
    name = str(words.get("distribution"))
    if name not in KINDS:
        raise InputError(f"there is no distribution {name!r}", do=f"choose one of {', '.join(KINDS)}")
    kind, given = KINDS[name], {key: value for key, value in words.items() if key != "distribution"}
    for key in kind.required:
        if key not in given:
            raise InputError(f"distribution {name} lacks {key!r}", do=f"give it {' and '.join(kind.required)}")
    for key in given:
        if key not in kind.fields:
            known = ", ".join(kind.fields) or "nothing else"
            raise InputError(f"distribution {name} has no {key!r}", do=f"it takes {known}")
    fields = {key: _plain(value, factor if key in kind.numbers else 1.0) for key, value in given.items()}
    made: Distribution = kind.make(**fields)
    return made


def _plain(value: Any, factor: float) -> Any:
    """`value` with lists as tuples and its numbers multiplied; truths and names stay."""
    if isinstance(value, list | tuple):
        return tuple(_plain(each, factor) for each in value)
    if isinstance(value, bool | str) or factor == 1.0:
        return value
    return value * factor


Shared = Mapping[str, Sequence[str]]
"""By a parameter that pictures share: what each picture's value is sampled for, such as its sequence, not its name."""


@dataclass(frozen=True, kw_only=True)
class Sample:
    """One parameter's distribution; `per_frame`: sampled for each picture, else once."""

    parameter: str
    distribution: Distribution
    per_frame: bool = False


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
            names = (shared or {}).get(sample.parameter, frames)
            values = {own: sample_one(sample, seed=seed, name=name, frame=own) for own in dict.fromkeys(names)}
            each[sample.parameter] = [values[own] for own in names]
    return ParameterValues(constant=one, per_frame=each)


def sample_one(sample: Sample, *, seed: int, name: str, frame: str = "", again: int = 0) -> Value:
    """Sample the value of one sample for one picture, or for all where `frame` is "": a function of its arguments
    alone.

    again: how many values before this one did not meet their constraints. Raises InputError that names the parameter.
    """
    names = (name, sample.parameter, frame, *([str(again)] if again else []))
    try:
        return sample.distribution.sample(stream(seed, *names))
    except InputError as error:
        raise InputError(error.found, where=sample.parameter, do=error.do) from None
