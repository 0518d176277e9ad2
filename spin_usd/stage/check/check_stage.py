"""Findings on a stage: USD's own validators, the rules for a dataset's stage, then the errors that a render would
raise.

A stage that `spin-usd author` has just written has no findings.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import numpy as np
from pxr import Ar, Sdf, Usd, UsdValidation

from spin_usd.basics.progress import Progress
from spin_usd.errors import InputError, SpinError, StageError
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.stage.check.cameras import camera_findings
from spin_usd.stage.check.every_picture import OnViews, TargetRule, scene_findings
from spin_usd.stage.check.poses import capture_findings, norm_findings, pose_findings
from spin_usd.stage.check.prims import (
    draw_mode_findings,
    extent_findings,
    kind_findings,
    label_findings,
    light_findings,
    light_unit_findings,
    property_findings,
    xform_findings,
)
from spin_usd.stage.check.variant_opinions import variant_findings
from spin_usd.stage.composition.files import named_assets, opened_assets
from spin_usd.stage.composition.materialx import names_document
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.parser_faults import parser_faults

# A dataset is a folder of layers that people read and diff; the rules for usdz packages do not apply.
SKIPPED_KEYWORD = "UsdzValidators"
COMPOSITION = "CompositionErrorTest"

StageRule: TypeAlias = Callable[[Usd.Stage], Iterator[Finding]]
ALWAYS = ("upAxis", "metersPerUnit")
UNCONVERTED = {
    "upAxis": "its prims lie on their side; rotate the prim that refers to it",
    "metersPerUnit": "its prims have another size; scale the prim that refers to it",
}
OF_A_ROOT = ("timeCodesPerSecond", "framesPerSecond", "startTimeCode", "endTimeCode")
FALLBACKS = {
    "upAxis": "upAxis Y",
    "metersPerUnit": "metersPerUnit 0.01",
    "timeCodesPerSecond": "24 time codes a second",
    "framesPerSecond": "24 frames a second",
    "startTimeCode": "a start at 0",
    "endTimeCode": "an end at 0",
    "defaultPrim": "no default prim",
}
"""USD's fallbacks where the root layer does not author the metadatum."""
UNIT_TOLERANCE = 1e-6  # relative, of metersPerUnit


def layer_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Every layer authors its metadata, in units that agree, and names files by anchored paths."""
    root = stage.GetRootLayer()
    for layer in stage.GetUsedLayers():
        packed = layer.GetFileFormat().IsPackage() or Ar.IsPackageRelativePath(layer.identifier)
        if not (layer.anonymous or packed):
            yield from _metadata(layer, root)
            yield from _paths(layer)
    prim = stage.GetDefaultPrim()
    named = bool(prim and prim.HasAPI(schema.CAPTURE_API))
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        yield from _time(layer, root, named)
    yield from _units(stage)


def _metadata(layer: Sdf.Layer, root: Sdf.Layer) -> Iterator[Finding]:
    """USD reads these from the root layer alone; a missing one falls back to Y, 0.01 m and 24."""
    authored = layer.pseudoRoot.ListInfoKeys()
    required = (*ALWAYS, *OF_A_ROOT) if layer == root else ALWAYS
    missing = [name for name in required if name not in authored]
    if not layer.HasDefaultPrim():
        missing.append("defaultPrim")
    if missing:
        yield Finding(
            code="layer-metadata",
            where=layer.identifier,
            message=f"the layer does not author {', '.join(missing)}, so where it is root USD takes "
            f"{', '.join(FALLBACKS[name] for name in missing)}; author the intended value",
            severity=WARNING,
        )


def _time(layer: Sdf.Layer, root: Sdf.Layer, named: bool) -> Iterator[Finding]:
    """Name a time code: in the stage's own layers it is a frame where the stage `named` its frames; references keep
    their own clock."""
    if layer.timeCodesPerSecond != root.timeCodesPerSecond and layer.HasTimeCodesPerSecond():
        yield Finding(
            code="layer-time",
            where=layer.identifier,
            message=f"timeCodesPerSecond is {layer.timeCodesPerSecond:g}, the root layer's is "
            f"{root.timeCodesPerSecond:g}: USD moves this layer's time samples, off the pictures; make them equal",
            severity=ERROR if named else WARNING,
        )


def _paths(layer: Sdf.Layer) -> Iterator[Finding]:
    """Asset paths are anchored. They stay in the stage's folder: a stage with one outside is not opened."""
    loose = sorted({path for path in named_assets(layer.realPath) if not path.startswith(("./", "../"))})
    if loose:
        for path in opened_assets(layer.realPath, loose):
            yield Finding(
                code="path-not-anchored",
                where=layer.identifier,
                message=f"the asset path {path!r} does not begin with './', so USD also looks for it elsewhere; "
                "write './' before it",
                severity=WARNING,
            )


def _units(stage: Usd.Stage) -> Iterator[Finding]:
    """USD converts neither units nor axes: a layer in others needs a scale or a rotation where it is referenced.

    The target's own axes are the body frame, so its layers may have any.
    """
    root = stage.GetRootLayer().pseudoRoot
    free = {
        "upAxis": _below(stage, lambda prim: prim.HasAPI(schema.TARGET_API)),
        "metersPerUnit": _below(stage, lambda prim: prim.HasAttribute(schema.UNITS_OP)),
    }
    for layer in stage.GetUsedLayers():
        info = layer.pseudoRoot
        for name in ALWAYS:
            if layer.identifier in free[name] or not (info.HasInfo(name) and root.HasInfo(name)):
                continue
            here, there = info.GetInfo(name), root.GetInfo(name)
            if here != there and not (name == "metersPerUnit" and np.isclose(here, there, rtol=UNIT_TOLERANCE, atol=0)):
                yield Finding(
                    code="layer-units",
                    where=layer.identifier,
                    message=f"{name} is {here}, the root layer's is {there}, and USD does not convert: "
                    f"{UNCONVERTED[name]}",
                    severity=WARNING,
                )


def _below(stage: Usd.Stage, chosen: Callable[[Usd.Prim], bool]) -> set[str]:
    """Return the layers, other than the stage's own, with opinions on a chosen prim or below it."""
    found: set[str] = set()
    for prim in stage.Traverse():
        if chosen(prim):
            for each in Usd.PrimRange(prim):
                arcs = Usd.PrimCompositionQuery(each).GetCompositionArcs()
                found |= {layer.identifier for arc in arcs for layer in arc.GetTargetNode().layerStack.layers}
    return found - {layer.identifier for layer in stage.GetLayerStack()}


STAGE_RULES: tuple[StageRule, ...] = (
    layer_findings,
    capture_findings,
    pose_findings,
    norm_findings,
    camera_findings,
    kind_findings,
    label_findings,
    light_findings,
    light_unit_findings,
    extent_findings,
    draw_mode_findings,
    property_findings,
    xform_findings,
    variant_findings,
)
"""All rules, in the order in which findings are reported."""


def check_stage(
    path: str | Path,
    *,
    progress: Progress = lambda *_: None,
    target_rule: TargetRule = lambda target: iter(()),
    on_views: OnViews = lambda views: None,
) -> tuple[Finding, ...]:
    """Return all findings on the stage whose root layer is at `path`, in the order of the rules; `target_rule` is a
    further rule, on each shape of its target; `on_views` receives the views of the stage's own pictures.

    A stage that may not be opened for rendering is not opened here either: that is its only finding. Raises InputError
    if there is no file at `path`.
    """
    if not Path(path).is_file():
        raise InputError("is not there, or is not a file", where=path)
    try:
        stage = open_as_it_is(path)
    except StageError as refusal:
        message = f"{refusal.found}; {refusal.do}"
        return (Finding(code="refused", where=str(refusal.where), message=message),)
    found = [*_findings_of(validator_findings, stage, path)]
    for rule in STAGE_RULES:
        found += _findings_of(rule, stage, path)
    found += scene_findings(path, stage, progress=progress, target_rule=target_rule, on_views=on_views)
    return tuple(found)


def _findings_of(rule: StageRule, stage: Usd.Stage, path: str | Path) -> Iterator[Finding]:
    """Yield the findings of one rule; a value that it cannot read is one more, and ends the rule."""
    try:
        with parser_faults(path):
            yield from rule(stage)
    except SpinError as refusal:
        do = f"; {refusal.do}" if refusal.do else ""
        yield Finding(code="unreadable", where=str(refusal.where), message=f"{refusal.found}{do}")


def validator_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Yield the findings of UsdValidation's own validators, without those for usdz packages.

    Composition errors are errors, since pictures lack something; all others are warnings, since pictures are right.
    """
    validators = [
        validator
        for validator in UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
        if SKIPPED_KEYWORD not in validator.GetMetadata().GetKeywords()
    ]
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        if error.GetType() == UsdValidation.ValidationErrorType.Info:
            continue
        yield Finding(
            code=str(error.GetIdentifier()),
            where=_site(error, stage),
            message=" ".join(error.GetMessage().split()),
            severity=_severity(error),
        )


def _severity(error: UsdValidation.ValidationError) -> str:
    broken = COMPOSITION in str(error.GetIdentifier()) and not names_document(error.GetMessage())
    return ERROR if broken else WARNING


def _site(error: UsdValidation.ValidationError, stage: Usd.Stage) -> str:
    for site in error.GetSites():
        if site.IsPrim():
            return str(site.GetPrim().GetPath())
        if site.IsProperty():
            return str(site.GetProperty().GetPath())
        if site.GetLayer():
            return str(site.GetLayer().identifier)
    return str(stage.GetRootLayer().identifier)
