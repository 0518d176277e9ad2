"""Sampled values as values of a stage's attributes, and those as a layer."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any

from pxr import Gf, Sdf, Usd

from spin_usd.stage.augment.attribute_change import BaseStage, ChangedAttribute, CopiedPrim
from spin_usd.stage.augment.parameters import attribute_changes
from spin_usd.stage.read.camera import find_camera
from spin_usd.stage.read.clock import Clock
from spin_usd.stage.read.frames import read_frames, read_seed
from spin_usd.stage.read.shutter import read_opening
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, root_number

PROGRESS_EVERY = 5000  # pictures


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledValue:
    """The value of an attribute: one, or one for each time code in `samples`."""

    attribute: ChangedAttribute
    value: Any = None
    samples: tuple[tuple[float, Any], ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledValues:
    """All that is written over a stage."""

    attributes: tuple[SampledValue, ...] = ()
    """In the order of their paths."""
    apis: tuple[tuple[str, str], ...] = ()
    """(prim, API schema) to apply."""
    copies: tuple[CopiedPrim, ...] = ()
    credit: str = ""
    """Credit for the data, if required."""

    def of(self, chosen: Callable[[str], bool]) -> "SampledValues":
        """Return the values of the chosen prims, by their paths."""
        return SampledValues(
            attributes=tuple(each for each in self.attributes if chosen(each.attribute.prim)),
            apis=tuple(each for each in self.apis if chosen(each[0])),
            credit=self.credit,
        )


def open_base(stage: Usd.Stage) -> tuple[BaseStage, tuple[str, ...], int]:
    """Return the stage as a base for sampled values, its pictures' names, and its seed. `stage` has its variants
    selected.

    Each picture's time is the middle of its exposure, when its lights and optics are read.
    """
    frames = read_frames(stage, "")
    camera = find_camera(stage)
    clock = Clock(stage)
    times = tuple(read_opening(camera, frame.time_code, clock, rows=1).middle for frame in frames)
    metres = root_number(stage, METRES_PER_UNIT)
    names = tuple(frame.name for frame in frames)
    base = BaseStage(stage=stage, times=times, metres=metres, names=dict(zip(times, names, strict=True)))
    return base, names, read_seed(stage)


def sampled_values(
    base: BaseStage,
    constant: Mapping[str, Any],
    per_frame: Mapping[str, Sequence[Any]],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SampledValues:
    """Turn sampled parameters into values of the stage's attributes: `constant` by parameter, `per_frame` one a
    picture.

    Raises InputError as `parameters.attribute_changes`.
    """
    found: list[SampledValue] = []
    apis: set[tuple[str, str]] = set()
    changes = attribute_changes(base, (*constant, *per_frame))
    for count, change in enumerate(changes):
        apis.update(change.apis)
        found += [SampledValue(attribute=attribute, value=value) for attribute, value in change.fixed]
        one = {name: constant[name] for name in change.parameters if name in constant}
        each = {name: per_frame[name] for name in change.parameters if name in per_frame}
        if not each and not change.varies:
            values = change.values(one, base.times[0])
            found += [SampledValue(attribute=a, value=v) for a, v in zip(change.attributes, values, strict=True)]
            continue
        rows = []
        for i, time in enumerate(base.times):
            if i % PROGRESS_EVERY == 0:
                progress(count * len(base.times) + i, len(changes) * len(base.times))
            rows.append(change.values({**one, **{name: values[i] for name, values in each.items()}}, time))
        for attribute, column in zip(change.attributes, zip(*rows, strict=True), strict=True):
            found.append(SampledValue(attribute=attribute, samples=tuple(zip(base.times, column, strict=True))))
    copies = tuple(each for change in changes for each in change.copies)
    for copy in copies:  # it changes like the other, except for its own values
        own = {each.attribute.name for each in found if each.attribute.prim == copy.path}
        alike = [each for each in found if each.attribute.prim == copy.of and each.attribute.name not in own]
        found += [replace(each, attribute=replace(each.attribute, prim=copy.path)) for each in alike]
    return SampledValues(attributes=_ordered(found), apis=tuple(sorted(apis)), copies=copies)


def overlaid(stronger: SampledValues, weaker: SampledValues) -> SampledValues:
    """Combine both; an attribute that both set has its value from `stronger`."""
    paths = {str(each.attribute) for each in stronger.attributes}
    kept = (each for each in weaker.attributes if str(each.attribute) not in paths)
    return SampledValues(
        attributes=_ordered((*stronger.attributes, *kept)),
        apis=tuple(sorted({*stronger.apis, *weaker.apis})),
        credit=stronger.credit or weaker.credit,
    )


def _ordered(values: Iterable[SampledValue]) -> tuple[SampledValue, ...]:
    return tuple(sorted(values, key=lambda each: (each.attribute.prim, each.attribute.name)))


def concatenated(parts: Sequence[tuple[Sequence[float], SampledValues]]) -> SampledValues:
    """Join the values for parts of a stage's pictures, each with the part's time codes, into the values for all of
    them; each part sets the same attributes."""
    if len(parts) == 1:
        return parts[0][1]
    by_path: dict[str, list[tuple[Sequence[float], SampledValue]]] = {}
    for times, values in parts:
        for each in values.attributes:
            by_path.setdefault(str(each.attribute), []).append((times, each))
    apis = {api for _, values in parts for api in values.apis}
    return SampledValues(attributes=tuple(map(_joined, by_path.values())), apis=tuple(sorted(apis)))


def _joined(parts: Sequence[tuple[Sequence[float], SampledValue]]) -> SampledValue:
    first = parts[0][1]
    if all(not each.samples and each.value == first.value for _, each in parts):
        return first
    samples = (each.samples or tuple((time, each.value) for time in times) for times, each in parts)
    return SampledValue(
        attribute=first.attribute, samples=tuple(sorted((s for each in samples for s in each), key=itemgetter(0)))
    )


def write_values(layer: Sdf.Layer, values: SampledValues, moves: Mapping[str, str] | None = None) -> None:
    """Author `values` in `layer`, as overs but for copies. moves: path prefixes of the stage -> of the layer, such as
    /World/Lights -> /Lights for a layer that is referenced there; the longest that fits counts."""
    with Sdf.ChangeBlock():
        for copy in values.copies:
            Sdf.CreatePrimInLayer(layer, path := _moved(copy.path, moves or {}))
            Sdf.CopySpec(copy.layer, copy.path, layer, path)
        for path, api in values.apis:
            _apply(Sdf.CreatePrimInLayer(layer, _moved(path, moves or {})), api)
        for each in values.attributes:
            prim = Sdf.CreatePrimInLayer(layer, _moved(each.attribute.prim, moves or {}))
            _author(prim, each)


def _moved(path: str, moves: Mapping[str, str]) -> Sdf.Path:
    own = Sdf.Path(path)
    for prefix in sorted(moves, key=len, reverse=True):
        if own.HasPrefix(Sdf.Path(prefix)):
            return own.ReplacePrefix(Sdf.Path(prefix), Sdf.Path(moves[prefix]))
    return own


def _apply(prim: Sdf.PrimSpec, api: str) -> None:
    items = prim.GetInfo("apiSchemas") if prim.HasInfo("apiSchemas") else Sdf.TokenListOp()
    if api not in items.GetAddedOrExplicitItems():
        prim.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=[*items.prependedItems, api]))


def _author(prim: Sdf.PrimSpec, sampled: SampledValue) -> None:
    changed = sampled.attribute
    variability = Sdf.VariabilityUniform if changed.uniform else Sdf.VariabilityVarying
    attribute = prim.attributes.get(changed.name) or Sdf.AttributeSpec(
        prim, changed.name, Sdf.ValueTypeNames.Find(changed.type), variability
    )
    if changed.cut:
        attribute.connectionPathList.ClearEditsAndMakeExplicit()
    if not sampled.samples:
        attribute.ClearInfo("timeSamples")
        attribute.default = sampled.value
    previous = None
    for time, value in sampled.samples:
        value = previous = _nearer(value, previous)
        prim.layer.SetTimeSample(attribute.path, time, value)


def _nearer(value: Any, previous: Any) -> Any:
    """Return the nearer one to `previous` of a rotation's two quaternions, so that USD interpolates the short way."""
    if isinstance(value, Gf.Quatd) and previous is not None and Gf.Dot(value, previous) < 0:
        return -value
    return value
