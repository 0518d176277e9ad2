"""Rules on variants: an opinion that a stronger one beats does nothing, silently; neither may two sets fight.

Strength is Local > Inherits > Variants > References: a value that a variant changes must come by reference. Of the sets
on a prim the one named first wins; the set `augmentation` is made to override the others, so it fights none.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import TypeAlias

from pxr import Sdf, Usd

from spin_usd.scene.finding import WARNING, Finding
from spin_usd.stage.check.every_picture import MAX_VARIANTS
from spin_usd.stage.check.poses_and_cameras import camera_findings
from spin_usd.stage.check.properties import property_findings
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.opinions import has_opinion
from spin_usd.stage.composition.prim_opinions import Opinion, Selection, opinions
from spin_usd.stage.composition.stage_hash import AUGMENTATION
from spin_usd.stage.usd import schema

FIELDS = ("active", "instanceable")  # of a prim; the strongest opinion holds

Statements: TypeAlias = dict[tuple[str, str], Selection]
"""What a variant set says: (where, what) -> a variant that says it."""


def variant_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Selects every variant of every set in turn, on a stage of its own, and looks at the opinions in it."""
    paths = [prim.GetPath() for prim in stage.Traverse() if prim.HasVariantSets()]
    if not paths:
        return
    trial = Usd.Stage.Open(stage.GetRootLayer(), Sdf.Layer.CreateAnonymous())
    trial.SetEditTarget(trial.GetSessionLayer())
    _deselect(trial.GetDefaultPrim(), AUGMENTATION)
    seen = _Seen(trial)
    for path in paths:
        found = _variants_of(trial, path, seen)
        yield from found if _holds_pictures(trial, path) else (replace(finding, severity=WARNING) for finding in found)


def _holds_pictures(stage: Usd.Stage, path: Sdf.Path) -> bool:
    """Whether the variants of the prim at `path` are what renders select. Those of an asset are its author's, and what
    they leave undone is only told."""
    prim = stage.GetPrimAtPath(path)
    return prim == stage.GetDefaultPrim() and bool(
        prim.HasAPI(schema.CAPTURE_API) or AUGMENTATION in prim.GetVariantSets().GetNames()
    )


def _variants_of(trial: Usd.Stage, path: Sdf.Path, seen: "_Seen") -> Iterator[Finding]:
    """Selects every variant of the prim's sets in turn."""
    yield from _selected(trial.GetPrimAtPath(path))
    said: dict[str, Statements] = {}
    for name in trial.GetPrimAtPath(path).GetVariantSets().GetNames():
        said[name] = {}
        for variant in trial.GetPrimAtPath(path).GetVariantSet(name).GetVariantNames()[:MAX_VARIANTS]:
            trial.GetPrimAtPath(path).GetVariantSet(name).SetVariantSelection(variant)
            tried = Selection(owner=path, name=name, variant=variant)
            yield from _VariantOpinions(tried, said[name]).findings(trial.GetPrimAtPath(path))
            yield from seen.anew(tried)
        _deselect(trial.GetPrimAtPath(path), name)
    yield from _fights({name: said[name] for name in said if name != AUGMENTATION})


def _deselect(prim: Usd.Prim, name: str) -> None:
    """As the stage has it; but no augmentation, which would override what the other sets say."""
    if prim and name in prim.GetVariantSets().GetNames():
        if name == AUGMENTATION:
            prim.GetVariantSet(name).BlockVariantSelection()
        else:
            prim.GetVariantSet(name).ClearVariantSelection()


class _Seen:
    """What was found before any variant was tried, on the stage `trial`."""

    def __init__(self, trial: Usd.Stage) -> None:
        self.trial = trial
        self.content = set(self._of_content())
        self.errors = set(composition_errors(trial))

    def anew(self, tried: Selection) -> Iterator[Finding]:
        """What only the variant does wrong, apart from its opinions."""
        if tried.name == AUGMENTATION:  # a render finds what does not compose
            new = [finding for finding in self._of_content() if finding not in self.content]
            yield from (replace(f, message=f"in variant {tried}, {f.message}") for f in new)
        elif errors := sorted(set(composition_errors(self.trial)) - self.errors):
            message = f"variant {tried} does not compose: {errors[0]}"
            yield Finding(code="variant-broken", where=str(tried.owner), message=message)

    def _of_content(self) -> Iterator[Finding]:
        """What a variant can do wrong beside what the reader refuses."""
        yield from camera_findings(self.trial)
        yield from property_findings(self.trial)


def _selected(prim: Usd.Prim) -> Iterator[Finding]:
    """Selections, as the stage stands, of variants that are not there: USD ignores them."""
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


def _fights(said: dict[str, Statements]) -> Iterator[Finding]:
    """`said` by the sets of one prim, the strongest first."""
    for (winner, strong), (_, weak) in combinations(said.items(), 2):
        for where, what in sorted(strong.keys() & weak.keys()):
            message = (
                f"variants {strong[where, what]} and {weak[where, what]} both author {what}: "
                f"where both are selected, {winner} wins; keep it in one of them"
            )
            yield Finding(code="variant-overlap", where=where, message=message, severity=WARNING)


class _VariantOpinions:
    """The opinions that the selected variant `tried` brings; they are added to what its set has `said`."""

    def __init__(self, tried: Selection, said: Statements) -> None:
        self.tried, self.said = tried, said

    def findings(self, owner: Usd.Prim) -> Iterator[Finding]:
        prims = iter(Usd.PrimRange(owner, Usd.PrimAllPrimsPredicate))
        for prim in prims:
            found = opinions(prim)
            own = [i for i, opinion in enumerate(found) if self.tried in opinion.through]
            if not own:
                prims.PruneChildren()
                continue
            yield from self._of_prim(prim, found, own)

    def _of_prim(self, prim: Usd.Prim, found: list[Opinion], own: list[int]) -> Iterator[Finding]:
        reaches_nothing = _unreached(prim)
        for name in sorted({name for i in own for name in found[i].properties}):
            where = str(prim.GetPath().AppendProperty(name))
            first = next((i for i in own if _has_value(found[i].properties.get(name))), None)
            if first is None:
                continue
            self.said[where, "this value"] = self.tried
            if reaches_nothing:
                message = f"variant {self.tried} authors this value, but {reaches_nothing}"
                yield Finding(code="variant-dead", where=where, message=message)
                continue
            stronger = (o for o in found[:first] if _beats(o.properties.get(name)))
            yield from self._beaten(where, "this value", next(stronger, None))
        for field in FIELDS:
            first = next((i for i in own if found[i].spec.HasInfo(field)), None)
            if first is not None:
                self.said[str(prim.GetPath()), field] = self.tried
                stronger = (o for o in found[:first] if o.spec.HasInfo(field))
                yield from self._beaten(str(prim.GetPath()), field, next(stronger, None))
        yield from self._of_selections(prim, found, own)

    def _of_selections(self, prim: Usd.Prim, found: list[Opinion], own: list[int]) -> Iterator[Finding]:
        for name in sorted({name for i in own for name in found[i].selections}):
            first = next(i for i in own if name in found[i].selections)
            variant = found[first].selections[name]
            what = f"the selection of {name}"
            self.said[str(prim.GetPath()), what] = self.tried
            stronger = (o for o in found[:first] if name in o.selections)
            beaten = list(self._beaten(str(prim.GetPath()), what, next(stronger, None)))
            yield from beaten
            if variant and not beaten:
                yield from _unknown(prim, name, variant, f"variant {self.tried} selects {name}={variant}")

    def _beaten(self, where: str, what: str, by: Opinion | None) -> Iterator[Finding]:
        """Sets of the same prim are told of as fights; an augmentation overrides by design."""
        if by is None or any(s.owner == self.tried.owner or s.name == AUGMENTATION for s in by.through):
            return
        says = f"variant {self.tried} authors {what}"
        if by.through:
            message = f"{says}, and so does variant {by.through[-1]}, which is stronger; keep it in one of them"
            yield Finding(code="variant-overlap", where=where, message=message, severity=WARNING)
        else:
            file = by.spec.layer.GetDisplayName()
            message = f"{says}, but the local one in {file} beats it: bring that one by reference"
            yield Finding(code="variant-dead", where=where, message=message)


def _unreached(prim: Usd.Prim) -> str:
    """Why no opinion on the prim means anything; empty where they do."""
    if not prim.IsActive():
        return "the prim is inactive then"
    if not prim.IsDefined() and not prim.IsAbstract() and not prim.GetTypeName():
        return "nothing defines the prim then"
    return ""


def _has_value(spec: Sdf.PropertySpec | None) -> bool:
    return spec is not None and has_opinion(spec)


def _beats(spec: Sdf.PropertySpec | None) -> bool:
    """Whether nothing of a weaker opinion is left. Targets are, unless the stronger list is the whole list."""
    if isinstance(spec, Sdf.RelationshipSpec):
        return bool(spec.targetPathList.isExplicit)
    return _has_value(spec)
