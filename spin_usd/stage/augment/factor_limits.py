"""Limits of factors on a material's inputs: the product must be a value that the input can have."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from spin_usd.errors import InputError
from spin_usd.scene.material import LIMITS
from spin_usd.stage.augment.attribute_change import BaseStage
from spin_usd.stage.augment.parameters import FIELDS, MATERIAL, parameter_named
from spin_usd.stage.usd.values import Range


def is_material_factor(name: str) -> bool:
    """Return whether the parameter multiplies an input of a material."""
    found = MATERIAL.fullmatch(name)
    return bool(found and found[3])


def check_factor(base: BaseStage, name: str, value: Any) -> None:
    """Raise InputError, where it is the name, for a factor that takes an input of `base` beyond a material's limits."""
    allowed = _allowed(name)
    for number in _multiplied(base, name, value):
        if number not in allowed:
            found = f"may be sampled as {value}, which turns an input into {number:g}"
            raise InputError(found, where=name, do=f"choose factors with which it is one of the {allowed}")


def factor_limits(base: BaseStage, name: str) -> Range:
    """Return the limits of a factor that is one number."""
    allowed, own = _allowed(name), [number for number in _multiplied(base, name, 1.0) if number > 0]
    limits = parameter_named(name).limits
    return Range(
        max([limits.low, *(allowed.low / number for number in own)]),
        min([limits.high, *(allowed.high / number for number in own)]),
    )


def _allowed(name: str) -> Range:
    limits = LIMITS[FIELDS[_input(name)]]
    return Range(limits.low, limits.high)


def _input(name: str) -> str:
    return name.split(".")[2]


def _multiplied(base: BaseStage, name: str, factor: Any) -> Iterator[float]:
    """Yield the products of the factor and inputs without an image, at the first picture."""
    change = parameter_named(name).make(base, (name,))
    values = change.values({name: factor}, base.times[0])
    for attribute, value in zip(change.attributes, values, strict=True):
        if attribute.name == f"inputs:{_input(name)}":
            yield from (float(number) for number in np.ravel(np.array(value, np.float64)))
