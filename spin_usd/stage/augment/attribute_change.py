"""Changes of attributes: which attributes of a stage a parameter decides, and how its value becomes theirs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pxr import Sdf, Usd, UsdGeom

from spin_usd.stage.read.camera import find_camera

ParameterValues = Mapping[str, Any]
"""The sampled value of each parameter, by its name."""


@dataclass(frozen=True, kw_only=True)
class ChangedAttribute:
    """An attribute that is changed, as USD spells it."""

    prim: str
    """Its prim's path."""
    name: str
    type: str
    uniform: bool = False
    """Its variability."""
    cut: bool = False
    """Whether connections to it are removed."""

    def __str__(self) -> str:
        return f"{self.prim}.{self.name}"


@dataclass(frozen=True, kw_only=True, eq=False)
class CopiedPrim:
    """A prim to define as a copy of another, with the same changes."""

    path: str
    of: str
    """The other's path."""
    layer: Sdf.Layer
    """Has the prim as the other is in the stage."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AttributeChange:
    """The change that one parameter makes, or several that act together."""

    parameters: tuple[str, ...]
    attributes: tuple[ChangedAttribute, ...]
    values: Callable[[ParameterValues, float], tuple[Any, ...]]
    """Gives the value of each of `attributes` for the sampled values and a time code."""
    varies: bool = False
    """Whether those change in time even where the sampled ones do not."""
    fixed: tuple[tuple[ChangedAttribute, Any], ...] = ()
    """Attributes that are authored once besides."""
    apis: tuple[tuple[str, str], ...] = ()
    """(prim, API schema) to apply."""
    copies: tuple[CopiedPrim, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class BaseStage:
    """A stage with its variants selected, over which sampled values are written."""

    stage: Usd.Stage
    times: tuple[float, ...]
    """Time codes at which the pictures are taken."""
    metres: float = 1.0
    """The length of a stage unit."""
    chosen_camera: Usd.Prim | None = None
    """The camera of several whose attributes are changed; None for the first."""
    names: Mapping[float, str] = field(default_factory=dict)
    """Names of the pictures by their time codes, as far as they are known."""

    @property
    def camera(self) -> Usd.Prim:
        return self.chosen_camera or find_camera(self.stage)

    @property
    def first(self) -> Usd.TimeCode:
        return Usd.TimeCode(self.times[0])


def attribute_of(attribute: Usd.Attribute, *, cut: bool = False) -> ChangedAttribute:
    """Describe an attribute that the stage has."""
    return ChangedAttribute(
        prim=str(attribute.GetPrim().GetPath()),
        name=attribute.GetName(),
        type=str(attribute.GetTypeName()),
        uniform=attribute.GetVariability() == Sdf.VariabilityUniform,
        cut=cut,
    )


def in_schema(api: str, name: str) -> str:
    """Return the type of an attribute of one of our API schemas, whether or not it is applied."""
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(api)
    return str(definition.GetAttributeDefinition(name).GetTypeName())


def fallback_of(api: str, name: str) -> Any:
    """Return the value that an attribute of one of our API schemas has unless one is authored."""
    return Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(api).GetAttributeFallbackValue(name)


def moves_in_time(prim: Usd.Prim) -> bool:
    """Return whether the prim, or one above it, moves."""
    while prim and not prim.IsPseudoRoot():
        xformable = UsdGeom.Xformable(prim)
        if xformable and xformable.TransformMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False
