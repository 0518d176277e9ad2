"""What was drawn, as opinions of a stage, and those as a layer."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from pxr import Gf, Sdf, Usd

from spin_usd.stage.augment.attribute_change import Base, Place
from spin_usd.stage.augment.parameters import settings
from spin_usd.stage.read.camera.camera import find_camera
from spin_usd.stage.read.camera.shutter import read_opening
from spin_usd.stage.read.frames import read_frames, read_seed
from spin_usd.stage.usd.root_metadata import METRES_PER_UNIT, root_number

TELL_EVERY = 5000  # pictures


@dataclass(frozen=True, kw_only=True, eq=False)
class Opinion:
    """The value of an attribute: one, or one for each time code of `samples`."""

    place: Place
    value: Any = None
    samples: tuple[tuple[float, Any], ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Opinions:
    """attributes: in the order of their paths · apis: (prim, API schema) to apply."""

    attributes: tuple[Opinion, ...] = ()
    apis: tuple[tuple[str, str], ...] = ()


def open_base(stage: Usd.Stage) -> tuple[Base, tuple[str, ...], int]:
    """The stage under what is drawn, its pictures' names, and its seed. `stage` has its variants selected.

    Each picture's time is the middle of its exposure, when its lights and optics are read.
    """
    frames = read_frames(stage, "")
    camera = find_camera(stage)
    times = tuple(read_opening(camera, frame.time_code, rows=1).middle for frame in frames)
    metres = root_number(stage, METRES_PER_UNIT)
    return Base(stage=stage, times=times, metres=metres), tuple(frame.name for frame in frames), read_seed(stage)


def opinions(
    base: Base,
    constant: Mapping[str, Any],
    per_frame: Mapping[str, Sequence[Any]],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Opinions:
    """What the values drawn make of the stage's attributes: `constant` by parameter, `per_frame` one for each picture.

    Raises InputError as `parameters.settings`.
    """
    found: list[Opinion] = []
    apis: set[tuple[str, str]] = set()
    made = settings(base, (*constant, *per_frame))
    for count, setting in enumerate(made):
        apis.update(setting.apis)
        found += [Opinion(place=place, value=value) for place, value in setting.fixed]
        one = {name: constant[name] for name in setting.parameters if name in constant}
        each = {name: per_frame[name] for name in setting.parameters if name in per_frame}
        if not each and not setting.varies:
            values = setting.values(one, base.times[0])
            found += [Opinion(place=p, value=v) for p, v in zip(setting.places, values, strict=True)]
            continue
        rows = []
        for i, time in enumerate(base.times):
            if i % TELL_EVERY == 0:
                progress(count * len(base.times) + i, len(made) * len(base.times))
            rows.append(setting.values({**one, **{name: drawn[i] for name, drawn in each.items()}}, time))
        for place, column in zip(setting.places, zip(*rows, strict=True), strict=True):
            found.append(Opinion(place=place, samples=tuple(zip(base.times, column, strict=True))))
    ordered = sorted(found, key=lambda opinion: (opinion.place.prim, opinion.place.attribute))
    return Opinions(attributes=tuple(ordered), apis=tuple(sorted(apis)))


def over(stronger: Opinions, weaker: Opinions) -> Opinions:
    """Both together; of an attribute that both set, what `stronger` says."""
    places = {str(opinion.place) for opinion in stronger.attributes}
    kept = (opinion for opinion in weaker.attributes if str(opinion.place) not in places)
    ordered = sorted((*stronger.attributes, *kept), key=lambda opinion: (opinion.place.prim, opinion.place.attribute))
    return Opinions(attributes=tuple(ordered), apis=tuple(sorted({*stronger.apis, *weaker.apis})))


def in_turn(parts: Sequence[tuple[Sequence[float], Opinions]]) -> Opinions:
    """The opinions of parts of a stage's pictures, each with the part's time codes, as those of all; each part has the
    same places."""
    if len(parts) == 1:
        return parts[0][1]
    by_place: dict[str, list[tuple[Sequence[float], Opinion]]] = {}
    for times, what in parts:
        for opinion in what.attributes:
            by_place.setdefault(str(opinion.place), []).append((times, opinion))
    apis = {api for _, what in parts for api in what.apis}
    return Opinions(attributes=tuple(map(_joined, by_place.values())), apis=tuple(sorted(apis)))


def _joined(parts: Sequence[tuple[Sequence[float], Opinion]]) -> Opinion:
    first = parts[0][1]
    if all(not opinion.samples and opinion.value == first.value for _, opinion in parts):
        return first
    samples = (opinion.samples or tuple((time, opinion.value) for time in times) for times, opinion in parts)
    return Opinion(place=first.place, samples=tuple(sorted((s for each in samples for s in each), key=itemgetter(0))))


def write_opinions(layer: Sdf.Layer, what: Opinions, moves: Mapping[str, str] | None = None) -> None:
    """Author them in `layer`, as overs. moves: path prefixes of the stage -> of the layer, such as /World/Lights ->
    /Lights for a layer that is referenced there; the longest that fits counts."""
    with Sdf.ChangeBlock():
        for path, api in what.apis:
            _apply(Sdf.CreatePrimInLayer(layer, _moved(path, moves or {})), api)
        for opinion in what.attributes:
            prim = Sdf.CreatePrimInLayer(layer, _moved(opinion.place.prim, moves or {}))
            _author(prim, opinion)


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


def _author(prim: Sdf.PrimSpec, opinion: Opinion) -> None:
    place = opinion.place
    variability = Sdf.VariabilityUniform if place.uniform else Sdf.VariabilityVarying
    attribute = prim.attributes.get(place.attribute) or Sdf.AttributeSpec(
        prim, place.attribute, Sdf.ValueTypeNames.Find(place.type), variability
    )
    if place.cut:
        attribute.connectionPathList.ClearEditsAndMakeExplicit()
    if not opinion.samples:
        attribute.default = opinion.value
    previous = None
    for time, value in opinion.samples:
        value = previous = _nearer(value, previous)
        prim.layer.SetTimeSample(attribute.path, time, value)


def _nearer(value: Any, previous: Any) -> Any:
    """Of the two quaternions of one rotation that nearer to the one before, so that USD turns the short way."""
    if isinstance(value, Gf.Quatd) and previous is not None and Gf.Dot(value, previous) < 0:
        return -value
    return value
