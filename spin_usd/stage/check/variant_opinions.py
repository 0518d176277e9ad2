"""Rules on variants: no stronger opinion may beat a variant's, and two sets must not author the same value.

Strength is Local > Inherits > Variants > References: a value that a variant changes must be referenced. Of the sets on
a prim the first one wins; the set `augmentation` is made to override the others, so it never conflicts.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TypeAlias

from pxr import Pcp, Sdf, Usd

from spin_usd.errors import StageError
from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.check.cameras import camera_findings
from spin_usd.stage.check.every_picture import MAX_VARIANTS
from spin_usd.stage.check.prims import property_findings
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.composition.opinions import has_opinion
from spin_usd.stage.composition.stage_hash import AUGMENTATION
from spin_usd.stage.usd import schema

FIELDS = ("active", "instanceable")  # of a prim; the strongest opinion holds


@dataclass(frozen=True, kw_only=True)
class VariantSelection:
    """The `variant` of the set `name` on the prim at `owner`, as composed."""

    owner: Sdf.Path
    name: str
    variant: str

    def __str__(self) -> str:
        return f"{self.name}={self.variant}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Opinion:
    """One layer's spec of a prim."""

    spec: Sdf.PrimSpec
    through: tuple[VariantSelection, ...]
    """The variant selections that contribute it, outermost first."""

    @cached_property
    def properties(self) -> dict[str, Sdf.PropertySpec]:
        """Its property specs, by name. Raises StageError where a damaged layer lists one that it does not hold."""
        specs = list(self.spec.properties)
        if not all(specs):
            where = f"{self.spec.layer.identifier} {self.spec.path}"
            raise StageError("lists a property that the layer does not hold", where=where, do="write the layer again")
        return {spec.name: spec for spec in specs}

    @cached_property
    def selections(self) -> dict[str, str]:
        """Its variant selections, by variant set."""
        return dict(self.spec.variantSelections.items())


def opinions(prim: Usd.Prim) -> list[Opinion]:
    """List all opinions on `prim`, strongest first, without the session layer, which is used for trials.

    Opinions of a layer that a variant references count as the variant's: they are as strong.
    """
    session = prim.GetStage().GetSessionLayer()
    return list(_of_node(prim.GetPrimIndex().rootNode, prim.GetPath(), (), session))


def _of_node(
    node: Pcp.NodeRef, composed: Sdf.Path, above: tuple[VariantSelection, ...], session: Sdf.Layer
) -> Iterator[Opinion]:
    through = above + tuple(each for each in _selections(node.path, composed) if each not in above)
    if node.hasSpecs:
        for layer in node.layerStack.layers:
            spec = layer.GetPrimAtPath(node.path) if layer != session else None
            if spec:
                yield Opinion(spec=spec, through=through)
    for child in node.children:  # in the order of their strength
        yield from _of_node(child, composed, through, session)


def _selections(path: Sdf.Path, composed: Sdf.Path) -> Iterator[VariantSelection]:
    """Yield the selections on the way to `path`, for the prim that is at `composed` on the stage."""
    for prefix in path.GetPrefixes():
        if prefix.IsPrimVariantSelectionPath():
            below = path.StripAllVariantSelections().pathElementCount
            below -= prefix.StripAllVariantSelections().pathElementCount
            owner = composed
            for _ in range(below):
                owner = owner.GetParentPath()
            name, variant = prefix.GetVariantSelection()
            yield VariantSelection(owner=owner, name=name, variant=variant)


Statements: TypeAlias = dict[tuple[str, str], VariantSelection]
"""The opinions of a variant set: (where, what) -> a variant that has that opinion."""


def variant_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Select every variant of every set in turn, on a separate stage, and check its opinions."""
    paths = [prim.GetPath() for prim in stage.Traverse() if prim.HasVariantSets()]
    if not paths:
        return
    trial = stage_on(stage.GetRootLayer())
    trial.SetEditTarget(trial.GetSessionLayer())
    _deselect(trial.GetDefaultPrim(), AUGMENTATION)
    baseline = _Baseline(trial)
    for path in paths:
        found = _variants_of(trial, path, baseline)
        yield from found if _holds_pictures(trial, path) else (replace(finding, severity=WARNING) for finding in found)


def _holds_pictures(stage: Usd.Stage, path: Sdf.Path) -> bool:
    """Return whether renders select the variants of the prim at `path`. Findings on variants of an asset are only
    warnings."""
    prim = stage.GetPrimAtPath(path)
    return prim == stage.GetDefaultPrim() and bool(
        prim.HasAPI(schema.CAPTURE_API) or AUGMENTATION in prim.GetVariantSets().GetNames()
    )


def _variants_of(trial: Usd.Stage, path: Sdf.Path, baseline: "_Baseline") -> Iterator[Finding]:
    """Select every variant of the prim's sets in turn."""
    yield from _selected(trial.GetPrimAtPath(path))
    statements: dict[str, Statements] = {}
    for name in trial.GetPrimAtPath(path).GetVariantSets().GetNames():
        statements[name] = {}
        for variant in trial.GetPrimAtPath(path).GetVariantSet(name).GetVariantNames()[:MAX_VARIANTS]:
            trial.GetPrimAtPath(path).GetVariantSet(name).SetVariantSelection(variant)
            tried = VariantSelection(owner=path, name=name, variant=variant)
            yield from _VariantOpinions(tried, statements[name]).findings(trial.GetPrimAtPath(path))
            yield from baseline.new_findings(tried)
        _deselect(trial.GetPrimAtPath(path), name)
    yield from _overlaps({name: statements[name] for name in statements if name != AUGMENTATION})


def _deselect(prim: Usd.Prim, name: str) -> None:
    """Reset the set's selection to the stage's own; for augmentations to none, which would override the other sets."""
    if prim and name in prim.GetVariantSets().GetNames():
        if name == AUGMENTATION:
            prim.GetVariantSet(name).BlockVariantSelection()
        else:
            prim.GetVariantSet(name).ClearVariantSelection()


class _Baseline:
    """The findings before any variant was tried, on the stage `trial`."""

    def __init__(self, trial: Usd.Stage) -> None:
        self.trial = trial
        self.content = set(self._of_content())
        self.errors = set(composition_errors(trial))

    def new_findings(self, tried: VariantSelection) -> Iterator[Finding]:
        """Yield the findings that only the variant causes, apart from those on its opinions."""
        if tried.name == AUGMENTATION:  # reading its pictures finds composition errors
            new = [finding for finding in self._of_content() if finding not in self.content]
            yield from (replace(f, message=f"in variant {tried}, {f.message}") for f in new)
        elif errors := sorted(set(composition_errors(self.trial)) - self.errors):
            message = f"variant {tried} does not compose: {errors[0]}"
            yield Finding(code="variant-broken", where=str(tried.owner), message=message)

    def _of_content(self) -> Iterator[Finding]:
        """Yield the findings of rules on content that a variant may break."""
        yield from camera_findings(self.trial)
        yield from property_findings(self.trial)


def _selected(prim: Usd.Prim) -> Iterator[Finding]:
    """Yield a finding for each selection of a missing variant: USD ignores it."""
    for name, variant in prim.GetVariantSets().GetAllVariantSelections().items():
        if variant and name in prim.GetVariantSets().GetNames():
            yield from _unknown(prim, name, variant, f"{name}={variant} is selected")


def _unknown(prim: Usd.Prim, name: str, variant: str, what: str) -> Iterator[Finding]:
    sets = prim.GetVariantSets()
    if name not in sets.GetNames():
        there = f"the prim has {_listed(sets.GetNames(), 'the variant sets ')}"
    elif variant not in sets.GetVariantSet(name).GetVariantNames():
        there = f"the set has {_listed(sets.GetVariantSet(name).GetVariantNames())}"
    else:
        return
    yield Finding(code="variant-unknown", where=str(prim.GetPath()), message=f"{what}, but {there}: USD ignores it")


def _listed(names: list[str], what: str = "") -> str:
    return f"{what}{', '.join(names)}" if names else "none"


def _overlaps(statements: dict[str, Statements]) -> Iterator[Finding]:
    """Yield a finding for each value that two sets of one prim author. statements: by set, the strongest first."""
    for (winner, strong), (_, weak) in combinations(statements.items(), 2):
        for where, what in sorted(strong.keys() & weak.keys()):
            message = (
                f"variants {strong[where, what]} and {weak[where, what]} both author {what}: "
                f"where both are selected, {winner} wins; keep it in one of them"
            )
            yield Finding(code="variant-overlap", where=where, message=message, severity=WARNING)


class _VariantOpinions:
    """The opinions of the selected variant `tried`; they are added to the `statements` of its set."""

    def __init__(self, tried: VariantSelection, statements: Statements) -> None:
        self.tried, self.statements = tried, statements

    def findings(self, owner: Usd.Prim) -> Iterator[Finding]:
        """Yield the findings on all opinions at and below `owner`."""
        prims = iter(Usd.PrimRange(owner, Usd.PrimAllPrimsPredicate))
        for prim in prims:
            found = opinions(prim)
            own = [i for i, opinion in enumerate(found) if self.tried in opinion.through]
            if not own:
                prims.PruneChildren()
                continue
            yield from self._of_prim(prim, found, own)

    def _of_prim(self, prim: Usd.Prim, found: list[Opinion], own: list[int]) -> Iterator[Finding]:
        without_effect = _without_effect(prim)
        for name in sorted({name for i in own for name in found[i].properties}):
            where = str(prim.GetPath().AppendProperty(name))
            first = next((i for i in own if _has_value(found[i].properties.get(name))), None)
            if first is None:
                continue
            self.statements[where, "this value"] = self.tried
            if without_effect:
                message = f"variant {self.tried} authors this value, but {without_effect}"
                yield Finding(code="variant-dead", where=where, message=message)
                continue
            stronger = (o for o in found[:first] if _beats(o.properties.get(name)))
            yield from self._beaten(where, "this value", next(stronger, None))
        for field in FIELDS:
            first = next((i for i in own if found[i].spec.HasInfo(field)), None)
            if first is not None:
                self.statements[str(prim.GetPath()), field] = self.tried
                stronger = (o for o in found[:first] if o.spec.HasInfo(field))
                yield from self._beaten(str(prim.GetPath()), field, next(stronger, None))
        yield from self._of_selections(prim, found, own)

    def _of_selections(self, prim: Usd.Prim, found: list[Opinion], own: list[int]) -> Iterator[Finding]:
        for name in sorted({name for i in own for name in found[i].selections}):
            first = next(i for i in own if name in found[i].selections)
            variant = found[first].selections[name]
            what = f"the selection of {name}"
            self.statements[str(prim.GetPath()), what] = self.tried
            stronger = (o for o in found[:first] if name in o.selections)
            beaten = list(self._beaten(str(prim.GetPath()), what, next(stronger, None)))
            yield from beaten
            if variant and not beaten:
                yield from _unknown(prim, name, variant, f"variant {self.tried} selects {name}={variant}")

    def _beaten(self, where: str, what: str, by: Opinion | None) -> Iterator[Finding]:
        """Yield a finding where `by` is stronger. Sets of the same prim are left to `_overlaps`; an augmentation may
        override, and so may a log, which records the stage's state at each picture, and a fit to real pictures."""
        if by is None or {schema.LOG, schema.FIT} & set(by.spec.layer.customLayerData.get(schema.PROVENANCE, {})):
            return
        if any(s.owner == self.tried.owner or s.name == AUGMENTATION for s in by.through):
            return
        statement = f"variant {self.tried} authors {what}"
        if by.through:
            message = f"{statement}, and so does variant {by.through[-1]}, which is stronger; keep it in one of them"
            yield Finding(code="variant-overlap", where=where, message=message, severity=WARNING)
        else:
            file = by.spec.layer.GetDisplayName()
            message = f"{statement}, but the local one in {file} beats it: bring that one by reference"
            yield Finding(code="variant-dead", where=where, message=message)


def _without_effect(prim: Usd.Prim) -> str:
    """Explain why no opinion on the prim has an effect; "" where they have."""
    if not prim.IsActive():
        return "the prim is inactive then"
    if not prim.IsDefined() and not prim.IsAbstract() and not prim.GetTypeName():
        return "nothing defines the prim then"
    return ""


def _has_value(spec: Sdf.PropertySpec | None) -> bool:
    return spec is not None and has_opinion(spec)


def _beats(spec: Sdf.PropertySpec | None) -> bool:
    """Return whether a weaker opinion has no effect. Targets are combined, unless the stronger list is explicit."""
    if isinstance(spec, Sdf.RelationshipSpec):
        return bool(spec.targetPathList.isExplicit)
    return _has_value(spec)
