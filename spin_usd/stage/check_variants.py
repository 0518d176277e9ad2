"""Rules on variants: an opinion that a stronger local one beats does nothing, silently; neither may two sets fight.

Strength is Local > Inherits > Variants > References: a value that a variant changes must come by reference.
"""

from collections.abc import Iterator
from dataclasses import replace

from pxr import Sdf, Usd

from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.check_pictures import camera_findings
from spin_usd.stage.check_properties import property_findings
from spin_usd.stage.check_scenes import MAX_VARIANTS
from spin_usd.stage.content import AUGMENTATION


def variant_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Selects every variant of every set in turn, on a stage of its own, and looks at the opinions in it."""
    paths = [prim.GetPath() for prim in stage.Traverse() if prim.HasVariantSets()]
    if not paths:
        return
    trial = Usd.Stage.Open(stage.GetRootLayer(), Sdf.Layer.CreateAnonymous())
    trial.SetEditTarget(trial.GetSessionLayer())
    found = set(_of_content(trial))
    for path in paths:
        sets = trial.GetPrimAtPath(path).GetVariantSets()
        for name in sets.GetNames():
            before = sets.GetVariantSelection(name)
            for variant in sets.GetVariantSet(name).GetVariantNames()[:MAX_VARIANTS]:
                sets.SetSelection(name, variant)
                yield from _opinions(trial.GetPrimAtPath(path), name, variant)
                if name == AUGMENTATION:
                    new = [finding for finding in _of_content(trial) if finding not in found]
                    yield from (replace(f, message=f"in variant {name}={variant}, {f.message}") for f in new)
            sets.SetSelection(name, before)


def _of_content(stage: Usd.Stage) -> Iterator[Finding]:
    """What a variant can do wrong beside what the reader refuses."""
    yield from camera_findings(stage)
    yield from property_findings(stage)


def _opinions(prim: Usd.Prim, name: str, variant: str) -> Iterator[Finding]:
    for below in Usd.PrimRange(prim):
        for attribute in below.GetAuthoredAttributes():
            specs = [spec for spec in attribute.GetPropertyStack() if _has_value(spec)]
            own = next((i for i, spec in enumerate(specs) if (name, variant) in _selections(spec.path)), None)
            if not own:  # not in this variant, or the strongest
                continue
            stronger = specs[0]
            where, what = str(attribute.GetPath()), f"variant {name}={variant} authors this value"
            if others := _selections(stronger.path):
                message = f"{what}, and so does variant {'='.join(others[-1])}, which is stronger"
                yield Finding(code="variant-overlap", where=where, message=message, severity=WARNING)
            else:
                file = stronger.layer.GetDisplayName()
                yield Finding(code="variant-dead", where=where, message=f"{what}, but the local one in {file} beats it")


def _has_value(spec: Sdf.AttributeSpec) -> bool:
    return bool(
        spec.HasDefaultValue()
        or spec.layer.GetNumTimeSamplesForPath(spec.path)
        or spec.connectionPathList.GetAddedOrExplicitItems()
    )


def _selections(path: Sdf.Path) -> list[tuple[str, str]]:
    """The variant selections on the way to `path`, outermost first."""
    found = []
    for prefix in path.GetPrefixes():
        if prefix.IsPrimVariantSelectionPath():
            found.append(tuple(prefix.GetVariantSelection()))
    return found
