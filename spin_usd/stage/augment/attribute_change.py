"""Settings: which attributes of a stage a parameter decides, and how its value becomes theirs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pxr import Sdf, Usd, UsdGeom

Values = Mapping[str, Any]
"""By parameter: what was drawn."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """An attribute, by USD's names. `uniform`: its variability · `cut`: connections to it are cut."""

    prim: str
    attribute: str
    type: str
    uniform: bool = False
    cut: bool = False

    def __str__(self) -> str:
        return f"{self.prim}.{self.attribute}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """What one or more parameters that act together decide.

    values: the value of each of `places`, of the drawn values at a time code · varies: those change in time even where
    the drawn ones do not · fixed: what is authored beside them, once · apis: (prim, API schema) to apply.
    """

    parameters: tuple[str, ...]
    places: tuple[Place, ...]
    values: Callable[[Values, float], tuple[Any, ...]]
    varies: bool = False
    fixed: tuple[tuple[Place, Any], ...] = ()
    apis: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Base:
    """A stage with its variants selected, under what is drawn.

    times: time codes at which the pictures are taken · metres: of a stage unit.
    """

    stage: Usd.Stage
    times: tuple[float, ...]
    metres: float = 1.0

    @property
    def first(self) -> Usd.TimeCode:
        return Usd.TimeCode(self.times[0])


def place_of(attribute: Usd.Attribute, *, cut: bool = False) -> Place:
    """The place of an attribute that is there."""
    return Place(
        prim=str(attribute.GetPrim().GetPath()),
        attribute=attribute.GetName(),
        type=str(attribute.GetTypeName()),
        uniform=attribute.GetVariability() == Sdf.VariabilityUniform,
        cut=cut,
    )


def in_schema(api: str, name: str) -> str:
    """The type of an attribute of one of our API schemas, whether or not it is applied."""
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(api)
    return str(definition.GetAttributeDefinition(name).GetTypeName())


def fallback_of(api: str, name: str) -> Any:
    """What an attribute of one of our API schemas is unless authored."""
    return Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(api).GetAttributeFallbackValue(name)


def placed_in_time(prim: Usd.Prim) -> bool:
    """Whether the prim, or one above it, moves."""
    while prim and not prim.IsPseudoRoot():
        xformable = UsdGeom.Xformable(prim)
        if xformable and xformable.TransformMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False
