"""Distributions limited to what a parameter takes, before anything is sampled: no seed decides what is refused."""

from collections.abc import Callable
from dataclasses import replace

from spin_usd.sampling.distribution import Choice, Distribution, Fixed, LogUniform, Normal, Uniform, Value
from spin_usd.stage.augment.parameter import Parameter
from spin_usd.stage.usd.values import Range

Check = Callable[[Value], None]


def limited(distribution: Distribution, parameter: Parameter) -> Distribution:
    """Return `distribution`, a normal one cut at the parameter's limits where its own ends are not given.

    Raises InputError, where it is the parameter's name, for ends and values outside of the limits.
    """
    if isinstance(distribution, Uniform | LogUniform):
        parameter.check_span(distribution.low, distribution.high)
    if isinstance(distribution, Normal):
        for end in distribution.ends:
            parameter.check(end)
    check_ends(distribution, parameter.check)
    return cut(distribution, parameter.limits)


def check_ends(distribution: Distribution, check: Check) -> None:
    """Call `check` with every value and both ends that `distribution` has by itself; a normal one can be cut."""
    match distribution:
        case Fixed(value=value):
            check(value)
        case Choice(values=values):
            for value in values:
                check(value)
        case Uniform(low=low, high=high) | LogUniform(low=low, high=high):
            check(low)
            check(high)


def cut(distribution: Distribution, limits: Range) -> Distribution:
    """Return a normal distribution of which only samples within `limits` count; any other as it is."""
    if not isinstance(distribution, Normal):
        return distribution
    low, high = max(distribution.low, limits.minimum), min(distribution.high, limits.high)
    return replace(distribution, low=low, high=high)
