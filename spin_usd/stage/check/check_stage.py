"""Findings on a stage: USD's own validators, the rules for a dataset's stage, then the errors that a render would
raise.

A stage that `spin-usd author` has just written has no findings.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

from pxr import Usd, UsdValidation

from spin_usd.errors import InputError, SpinError, StageError
from spin_usd.progress import Progress
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.stage.check.every_picture import OnViews, TargetRule, scene_findings
from spin_usd.stage.check.layers import layer_findings
from spin_usd.stage.check.poses_and_cameras import camera_findings, capture_findings, norm_findings, pose_findings
from spin_usd.stage.check.prims import (
    draw_mode_findings,
    extent_findings,
    kind_findings,
    label_findings,
    light_findings,
)
from spin_usd.stage.check.properties import property_findings
from spin_usd.stage.check.variant_opinions import variant_findings
from spin_usd.stage.composition.materialx import names_document
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.usd.parser_faults import parser_faults

# A dataset is a folder of layers that people read and diff; the rules for usdz packages do not apply.
SKIPPED_KEYWORD = "UsdzValidators"
COMPOSITION = "CompositionErrorTest"

StageRule: TypeAlias = Callable[[Usd.Stage], Iterator[Finding]]

STAGE_RULES: tuple[StageRule, ...] = (
    layer_findings,
    capture_findings,
    pose_findings,
    norm_findings,
    camera_findings,
    kind_findings,
    label_findings,
    light_findings,
    extent_findings,
    draw_mode_findings,
    property_findings,
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
    """Return all findings on the stage whose root layer is at `path`, in the order of the rules; `target_rule` is one
    more, on each shape of its target; `on_views` receives the views of the stage's own pictures.

    A stage that may not be opened for rendering is not opened here either: that is its only finding. Raises InputError
    when there is no file at `path`.
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
