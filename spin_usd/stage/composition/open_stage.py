"""Stages opened for reading: checked, composed without errors, one augmentation selected."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import MappingProxyType

from pxr import Ar, Sdf, Usd, UsdUtils

from spin_usd.errors import StageError, UnknownPictureError
from spin_usd.scene.scene import NOMINAL
from spin_usd.stage.composition.files import Files, files_of
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.open_layer import default_prim_on, stage_on
from spin_usd.stage.composition.stage_hash import AUGMENTATION
from spin_usd.stage.usd.layer_file import layer_at
from spin_usd.stage.usd.parser_faults import parser_faults

VARIANT_NAME = re.compile("[a-z0-9_]+")  # it names folders; the records' schema requires the same


def open_stage(
    path: str | Path, *, variant: str = NOMINAL, selections: Mapping[str, str] = MappingProxyType({})
) -> Usd.Stage:
    """Open the stage at `path`, payloads loaded, with `variant` of the default prim's variant set `augmentation`, and
    the `selections` (set to variant) of its other sets, which override those of the stage and its augmentation.

    "nominal" is the stage without any augmentation, whatever it selects itself, unless it has a variant of that name.
    Raises StageError for a file that USD must not open (see `files`), any composition error, too many prims, a variant
    whose name cannot name a folder, or an unknown variant or set.
    """
    files = files_of(path)
    with silenced(), parser_faults(path):
        root, session = layer_at(files.root), Sdf.Layer.CreateAnonymous("session.usda")
        alone = default_prim_on(root, session)  # the prims of its variants are counted before it is composed
        _select(alone, variant, path)
        for name, chosen in selections.items():
            _select_other(alone, name, chosen, path)
        stage = stage_on(root, session)
        _refuse_errors(stage, path)
        _refuse_strangers(stage, files, path)
    return stage


def open_as_it_is(path: str | Path) -> Usd.Stage:
    """Open the stage at `path` as it is, composition errors included; files that could harm the reader are still
    refused."""
    files = files_of(path)
    with parser_faults(path):
        stage = stage_on(layer_at(files.root))
    _refuse_strangers(stage, files, path)
    return stage


def variants(stage: Usd.Stage) -> tuple[str, ...]:
    """List the variants that `open_stage` accepts: "nominal" first, then the others in alphabetical order."""
    return (NOMINAL, *sorted(set(_variant_names(stage)) - {NOMINAL}))


def compositions(stage: Usd.Stage) -> Iterator[tuple[str, Callable[[], Usd.Stage]]]:
    """Yield each of the stage's variants with a function that composes it anew, from the same root layer, and raises
    StageError if it is too large."""
    for name in variants(stage):
        yield name, partial(_composed, stage.GetRootLayer(), name)


def _composed(root: Sdf.Layer, variant: str) -> Usd.Stage:
    with silenced():
        session = Sdf.Layer.CreateAnonymous("session.usda")
        _select(default_prim_on(root, session), variant, root.realPath)
        return stage_on(root, session)


def _variant_names(stage: Usd.Stage) -> list[str]:
    prim = stage.GetDefaultPrim()
    names: list[str] = prim.GetVariantSet(AUGMENTATION).GetVariantNames() if prim else []
    return names


def _select(stage: Usd.Stage, variant: str, path: str | Path) -> None:
    names = variants(stage)
    for name in names:
        if not VARIANT_NAME.fullmatch(name):
            do = "use small letters, digits and '_'"
            raise StageError(f"has a variant named {name!r}, which cannot name a folder", where=path, do=do)
    if variant not in names:
        raise UnknownPictureError(f"has no variant '{variant}'", where=path, do=f"choose one of {', '.join(names)}")
    prim = stage.GetDefaultPrim()
    if not prim:
        return
    augmentations = prim.GetVariantSet(AUGMENTATION)
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        if variant in _variant_names(stage):
            augmentations.SetVariantSelection(variant)
        elif augmentations.GetVariantSelection():
            # An empty selection is an opinion, and beats one that the stage's own layers author.
            augmentations.BlockVariantSelection()


def _select_other(stage: Usd.Stage, name: str, variant: str, path: str | Path) -> None:
    sets = stage.GetDefaultPrim().GetVariantSets() if stage.GetDefaultPrim() else None
    names = sorted(set(sets.GetNames()) - {AUGMENTATION}) if sets else []
    if sets is None or name not in names:
        do = f"choose one of {', '.join(names)}" if names else "name one of its augmentations"
        raise StageError(f"has no variant set '{name}' on its default prim", where=path, do=do)
    offered = sets.GetVariantSet(name).GetVariantNames()
    if variant not in offered:
        do = f"choose one of {', '.join(offered)}"
        raise StageError(f"has no variant '{variant}' in its set '{name}'", where=path, do=do)
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        sets.SetSelection(name, variant)


def _refuse_errors(stage: Usd.Stage, path: str | Path) -> None:
    errors = composition_errors(stage)
    if errors:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        first = errors[0].rstrip(".")
        raise StageError(f"does not compose: {first}{more}", where=path, do="fix the layer it names")


def _refuse_strangers(stage: Usd.Stage, files: Files, path: str | Path) -> None:
    """Raise StageError for a layer that was not checked before it was opened."""
    for layer in stage.GetUsedLayers():
        file = Ar.SplitPackageRelativePathOuter(layer.realPath)[0]
        if not layer.anonymous and Path(file).resolve() not in files.found:
            raise StageError(f"uses {layer.identifier}, which its layers do not name", where=path, do="name it")


@contextmanager
def silenced() -> Iterator[None]:
    """Keep USD's warnings off the terminal: important ones are raised as errors."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()
        del delegate
