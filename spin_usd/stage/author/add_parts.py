"""Names and classes that a user gives a model's parts, written over an authored stage as semantic labels."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom, UsdShade

from spin_usd.errors import InputError
from spin_usd.scene.part_rule import PartRule, first_match
from spin_usd.stage.author.added_layer import add_layer
from spin_usd.stage.author.paths import MODEL, TARGET
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.read.bodies.face_subsets import binds_material, find_subsets
from spin_usd.stage.read.bodies.part_labels import labels_of_target
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import author_metadata, writing
from spin_usd.stage.usd.values import DEFAULT_TIME, TEXTS, read
from spin_usd.stage.usd.visibility import PROXIES

FILE = "parts.usda"
LABELS = {schema.PART_LABELS: "SemanticsLabelsAPI:part", schema.CLASS_LABELS: "SemanticsLabelsAPI:class"}
NO_SURFACES = (UsdGeom.Points, UsdGeom.Curves)


@dataclass(frozen=True, kw_only=True)
class ModelSurface:
    """A gprim, or a subset of its faces that has a material of its own."""

    path: Sdf.Path
    names: tuple[str, ...]
    """Its own and those of the prims above it, and their paths below the model."""
    materials: tuple[str, ...]
    """Names of its material."""
    class_name: str
    """Its class."""
    instances: tuple[Sdf.Path, ...]
    """Paths of the instances that hold it."""


def model_surfaces(target: Usd.Prim, model: Usd.Prim) -> Iterator[ModelSurface]:
    """Yield the surfaces of all gprims at and below `model`, which is below `target`."""
    for prim in Usd.PrimRange(model, PROXIES):
        if prim.IsA(UsdGeom.Gprim) and not any(prim.IsA(kind) for kind in NO_SURFACES):
            yield _surface(prim, target, model)
            for subset in find_subsets(prim):
                if binds_material(subset):
                    yield _surface(subset.GetPrim(), target, model)


def _surface(prim: Usd.Prim, target: Usd.Prim, model: Usd.Prim) -> ModelSurface:
    stage, root = prim.GetStage(), model.GetPath()
    chain = [stage.GetPrimAtPath(path) for path in prim.GetPath().GetPrefixes() if path.HasPrefix(root)]
    labels = labels_of_target(target)
    for each in chain:
        labels = labels.below(each)
    below = [each for each in chain if each != model] or chain
    paths = [str(each.GetPath().MakeRelativePath(root)) for each in below]
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    return ModelSurface(
        path=prim.GetPath(),
        names=_unique(*map(_names, below), paths),
        materials=_unique(_names(material.GetPrim())) if material else (),
        class_name=labels.class_name,
        instances=tuple(each.GetPath() for each in chain if each.IsInstance()),
    )


def _names(prim: Usd.Prim) -> list[str]:
    """Return its prim name, the names of its groups, its display name, and the names of its part labels."""
    groups, labels = (
        read(prim.GetAttribute(name), DEFAULT_TIME, *TEXTS) or () for name in (schema.GROUP_LABELS, schema.PART_LABELS)
    )
    return [name for name in (prim.GetName(), *groups, prim.GetDisplayName(), *labels) if name]


def _unique(*names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for each in names for name in each))


def add_parts(root: Path, rules: Sequence[PartRule], where: object) -> tuple[dict[str, int], int]:
    """Label the surfaces of the model in the stage at `root`: all that a part's rules match become one part. Returns
    the number of surfaces of each part, and of those that no rule matches.

    A surface whose names no rule matches keeps its part and its class. Instances that hold matched surfaces are made
    plain prims, since labels cannot be authored inside an instance. `where`: the rules' file, for messages. Raises
    InputError for a rule that labels nothing, and for a part of several classes; OutputError.
    """
    stage = open_stage(root)
    found = list(model_surfaces(stage.GetPrimAtPath(TARGET), stage.GetPrimAtPath(MODEL)))
    chosen = [(each, rule) for each in found if (rule := first_match(rules, each.names + each.materials))]
    _refuse_idle(rules, found, {rule.pattern for _, rule in chosen}, where)
    _refuse_mixed(chosen, where)
    add_layer(root, _layer(chosen), FILE, {MODEL: Sdf.Path.absoluteRootPath.AppendChild(MODEL.name)})
    made = open_layer(root)
    edited = stage_on(made)
    sizes = Counter(rule.part for _, rule in chosen)
    edited.GetPrimAtPath(TARGET).GetAttribute(schema.TARGET_MERGED_PARTS).Set(list(sizes))
    with writing(root):
        made.Save()
    return dict(sizes), len(found) - len(chosen)


def _refuse_idle(rules: Sequence[PartRule], found: Sequence[ModelSurface], used: set[str], where: object) -> None:
    """Raise InputError for a rule that labels no surface."""
    for rule in rules:
        if rule.pattern in used:
            continue
        if any(rule.matches(each.names + each.materials) for each in found):
            what, do = "matches only what rows before it match", "put it before them, or remove it"
        else:
            materials = dict.fromkeys(each.materials[-1] for each in found if each.materials)
            prims = dict.fromkeys(each.names[0] for each in found) | dict.fromkeys(each.names[-1] for each in found)
            what = "matches nothing"
            do = f"the materials are {', '.join(materials) or 'none'}; the prims are {', '.join(prims)}"
            do += "; [...] stands for one of its characters, [[] for a bracket" * ("[" in rule.pattern)
        raise InputError(f"the pattern {rule.pattern!r} {what}", where=where, do=do)


def _refuse_mixed(chosen: Sequence[tuple[ModelSurface, PartRule]], where: object) -> None:
    """Raise InputError for a part without a given class whose surfaces have several."""
    first: dict[str, ModelSurface] = {}
    for surface, rule in chosen:
        other = first.setdefault(rule.part, surface)
        if rule.class_name is None and surface.class_name != other.class_name:
            classes = f"{other.class_name!r} ({other.path.name}) and {surface.class_name!r} ({surface.path.name})"
            raise InputError(
                f"the part {rule.part!r} would be of the classes {classes}", where=where, do="give it a class"
            )


def _layer(chosen: Sequence[tuple[ModelSurface, PartRule]]) -> Sdf.Layer:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=MODEL.name, documentation="The parts' names and classes that were given.")
    model = Sdf.Path.absoluteRootPath.AppendChild(MODEL.name)
    Sdf.CreatePrimInLayer(layer, model)
    for surface, rule in chosen:
        for instance in surface.instances:
            Sdf.CreatePrimInLayer(layer, instance.ReplacePrefix(MODEL, model)).instanceable = False
        prim = Sdf.CreatePrimInLayer(layer, surface.path.ReplacePrefix(MODEL, model))
        _label(prim, schema.PART_LABELS, rule.part)
        if rule.class_name is not None:
            _label(prim, schema.CLASS_LABELS, rule.class_name)
    return layer


def _label(prim: Sdf.PrimSpec, name: str, label: str) -> None:
    applied = prim.GetInfo("apiSchemas").prependedItems if prim.HasInfo("apiSchemas") else []
    prim.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=[*applied, LABELS[name]]))
    Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.TokenArray).default = [label]
