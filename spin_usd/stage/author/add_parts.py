"""Names and classes that a user gives a model's parts, written over an authored stage as semantic labels."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pxr import Sdf

from spin_usd.errors import InputError
from spin_usd.scene.name_rule import PartRule, Rules
from spin_usd.stage.author.added_layer import add_layer
from spin_usd.stage.author.model_surfaces import ModelSurface, model_surfaces, refuse_idle
from spin_usd.stage.author.paths import MODEL, TARGET
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.composition.open_stage import open_stage
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import author_metadata, writing

FILE = "parts.usda"
LABELS = {schema.PART_LABELS: "SemanticsLabelsAPI:part", schema.CLASS_LABELS: "SemanticsLabelsAPI:class"}


def add_parts(
    root: Path, rules: Sequence[PartRule], where: object, model_materials: Mapping[str, tuple[str, ...]]
) -> tuple[dict[str, int], int]:
    """Label the surfaces of the model in the stage at `root`: all that a part's rules match become one part. Returns
    the number of surfaces of each part, and of unmatched ones.

    A surface whose names no rule matches keeps its part and its class. Instances that hold matched surfaces are made
    plain prims, since labels cannot be authored inside an instance. `where`: the rules' file, for messages.
    `model_materials`: names of materials that surfaces have only in the model, by their paths below it. Raises
    InputError for a rule that labels nothing, and for a part of several classes; OutputError.
    """
    stage = open_stage(root)
    surfaces = model_surfaces(stage.GetPrimAtPath(TARGET), stage.GetPrimAtPath(MODEL))
    found = [replace(each, materials=(*each.materials, *model_materials.get(each.below, ()))) for each in surfaces]
    first = Rules(rules).first
    chosen = [(each, rule) for each in found if (rule := first(each.all_names))]
    refuse_idle(rules, found, {rule for _, rule in chosen}, where)
    _refuse_mixed(chosen, where)
    add_layer(root, _layer(chosen), FILE, {MODEL: Sdf.Path.absoluteRootPath.AppendChild(MODEL.name)})
    made = open_layer(root)
    edited = stage_on(made)
    sizes = Counter(rule.part for _, rule in chosen)
    edited.GetPrimAtPath(TARGET).GetAttribute(schema.TARGET_MERGED_PARTS).Set(list(sizes))
    with writing(root):
        made.Save()
    return dict(sizes), len(found) - len(chosen)


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
