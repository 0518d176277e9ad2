"""material.NAME.variation: another appearance of the same kind of material, selected by one number.

For a material of the library the variation draws one of its colours, a roughness within its limits, and the size and
place of its crinkles: a foil stays a foil, and solar cells stay cells. Any other material may become anything, without
images: training must not learn the looks of a model without material data.
"""

from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import numpy as np
from pxr import Gf, Usd, UsdShade

from spin_usd.stage.augment.attribute_change import AttributeChange, BaseStage, ChangedAttribute
from spin_usd.stage.augment.materials import factors, replaced, surfaces_named
from spin_usd.stage.author.material_library import CUSTOM
from spin_usd.stage.usd.shader_inputs import Output, read_input

VARIATION = "variation"
STEPS = 2**53  # the numbers from 0 to 1 that a float can distinguish
DRAWS = 6
ANY_COLOR = (
    (0.02, 0.02, 0.02), (0.1, 0.1, 0.1), (0.3, 0.3, 0.3), (0.6, 0.6, 0.6), (0.9, 0.9, 0.9), (0.8, 0.1, 0.05),
    (0.9, 0.4, 0.05), (0.85, 0.65, 0.1), (0.1, 0.5, 0.1), (0.05, 0.15, 0.6), (0.4, 0.1, 0.5),
)  # fmt: skip
ANY_METALLIC = (0.0, 0.0, 0.5, 1.0)
ANY_ROUGHNESS = (0.05, 1.0)
DARKEST = 0.8  # of a drawn colour: how worn it may be
Draws: TypeAlias = tuple[float, ...]
"""DRAWS numbers from 0 to 1."""
Drawn: TypeAlias = tuple[ChangedAttribute, Callable[[Draws], Any]]
"""An attribute, and how its value follows from the draws."""


def variation(base: BaseStage, names: tuple[str, ...]) -> AttributeChange:
    """Return the change that the sampled number, from 0 to 1, makes to the materials of that name."""
    (parameter,) = names
    name = parameter.removeprefix("material.").partition(".")[0]
    found: dict[str, Drawn] = {}
    for material, shader in surfaces_named(base, name, parameter):
        said = material.GetPrim().GetCustomData().get(CUSTOM)
        for drawn in _of_library(shader, said, base.first) if isinstance(said, dict) else _anything(shader):
            found[str(drawn[0])] = drawn
    makers = tuple(make for _, make in found.values())

    def values(sampled: Any, _: float) -> tuple[Any, ...]:
        draws = tuple(np.random.default_rng(int(sampled[parameter] * STEPS)).random(DRAWS).tolist())
        return tuple(make(draws) for make in makers)

    return AttributeChange(parameters=names, attributes=tuple(each for each, _ in found.values()), values=values)


def _anything(shader: UsdShade.Shader) -> Iterator[Drawn]:
    yield _drawn(replaced(shader, "diffuseColor"), lambda draws: _one_of(ANY_COLOR, draws[0]))
    yield _drawn(replaced(shader, "roughness"), lambda draws: _between(ANY_ROUGHNESS, draws[1]))
    yield _drawn(replaced(shader, "metallic"), lambda draws: _one_of(ANY_METALLIC, draws[2]))


def _drawn(changed: tuple[ChangedAttribute, Callable[[Any], Any]], value: Callable[[Draws], Any]) -> Drawn:
    """Return the attribute with the function that makes its value from the draws."""
    attribute, make = changed
    return attribute, lambda draws: make(value(draws))


def _of_library(shader: UsdShade.Shader, said: dict[str, Any], time: Usd.TimeCode) -> Iterator[Drawn]:
    """Yield the variations of a material of the library; `said`: its own description."""
    colors = [tuple(float(each) for each in color) for color in said.get("colors", ())]
    if colors:
        image = isinstance(read_input(shader, "diffuseColor", time), Output)
        for changed in factors(shader, "diffuseColor", time) if image else [replaced(shader, "diffuseColor")]:
            yield _drawn(changed, lambda draws: _worn(_one_of(colors, draws[0]), draws[1]))
    if "roughness" in said:
        limits, roughness = said["roughness"], read_input(shader, "roughness", time)
        changed = replaced(shader, "roughness")
        if isinstance(roughness, Output):
            changed = _shifted(roughness.shader, float(said["middle"]), time)
        yield _drawn(changed, lambda draws: _between(limits, draws[2]))
    normal = read_input(shader, "normal", time)
    if "scale" in said and isinstance(normal, Output):
        yield from _laid(read_input(normal.shader, "st", time), said["scale"], time)


def _laid(placement: Any, sizes: Any, time: Usd.TimeCode) -> Iterator[Drawn]:
    """Yield the size of a pattern, between the factors `sizes` on its own, and where it lies."""
    if isinstance(placement, Output) and placement.node == "UsdTransform2d":
        own, at = Gf.Vec2f(read_input(placement.shader, "scale", time)), str(placement.shader.GetPath())
        size = ChangedAttribute(prim=at, name="inputs:scale", type="float2")
        yield _drawn((size, lambda factor: own / factor), lambda draws: _between(sizes, draws[3]))
        place = ChangedAttribute(prim=at, name="inputs:translation", type="float2")
        yield _drawn((place, lambda shift: Gf.Vec2f(*shift)), lambda draws: draws[4:6])


def _shifted(
    texture: UsdShade.Shader, middle: float, time: Usd.TimeCode
) -> tuple[ChangedAttribute, Callable[[Any], Any]]:
    """Return the bias of a roughness's image, and how it follows from another roughness in place of its `middle`: as
    far as all of it stays between 0 and 1."""
    scale, bias = (float(read_input(texture, name, time)[0]) for name in ("scale", "bias"))
    low, high = min(bias, bias + scale), max(bias, bias + scale)
    at = ChangedAttribute(prim=str(texture.GetPath()), name="inputs:bias", type="float4")
    return at, lambda drawn: Gf.Vec4f(bias + min(max(drawn - middle, -low), 1 - high))


def _one_of(values: Any, draw: float) -> Any:
    return values[min(int(draw * len(values)), len(values) - 1)]


def _between(limits: Any, draw: float) -> float:
    low, high = limits
    return float(low + (high - low) * draw)


def _worn(color: tuple[float, ...], draw: float) -> tuple[float, ...]:
    return tuple(each * _between((DARKEST, 1.0), draw) for each in color)
