"""A USD target, given as a file or by the name of one that travels with spin_usd, copied with all it depends on."""

import os
from dataclasses import replace
from functools import partial
from pathlib import Path

from pxr import Sdf, Usd, UsdUtils

from spin_usd.errors import InputError
from spin_usd.stage.author.target.gathered_roots import gather_roots
from spin_usd.stage.author.target.target_asset import TargetAsset, describe, open_source
from spin_usd.stage.author.target.target_root import notes_on_root, outside, target_root
from spin_usd.stage.composition.backslashes import slashes
from spin_usd.stage.composition.files import files_of
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.missing_images import dispensable_images
from spin_usd.stage.composition.open_stage import open_as_it_is, silenced
from spin_usd.stage.usd.layer_file import layer_at, writing
from spin_usd.stage.usd.parser_faults import parser_faults

LAYER_SUFFIXES = {".usd", ".usda", ".usdc"}


def copy_usd_target(
    source: Path, folder: Path, name: str, units_per_metre: float | None, prim: str | None = None
) -> TargetAsset:
    """Copy the asset at `source` with all it depends on into `folder`, which must not exist yet. `prim` is the path of
    the target in it, where that is not the default prim.

    Raises InputError that names the file, OutputError when the copy cannot be written.
    """
    with silenced(), parser_faults(source), slashes(source):
        incomplete = _refuse_missing(source)
        stage = open_source(source)
        root = target_root(stage, source, prim)
        alone = _stands_alone(stage, source, root)
        with writing(folder):
            folder.mkdir(parents=True)
            copied = UsdUtils.LocalizeAsset(Sdf.AssetPath(str(source)), str(folder))
            _anchor(folder)
        file = folder / source.resolve().name
        if not (copied or incomplete) or composition_errors(open_as_it_is(file)):
            raise InputError("cannot be copied with what it depends on", where=source)
        if not alone:
            file = gather_roots(file, root)
        chosen = str(root) if alone and root != stage.GetDefaultPrim().GetPath() else None
        found = describe(file, name, units_per_metre, prim=chosen, source=source)
        return replace(found, source_prim=str(root), notes=notes_on_root(stage, root, prim))


def _stands_alone(stage: Usd.Stage, source: Path, root: Sdf.Path) -> bool:
    """Return whether a reference to `root` includes all that it uses. Raises InputError for a relationship to a missing
    prim."""
    if root == Sdf.Path.absoluteRootPath:
        return False
    found = list(outside(stage, root))
    lost = next(((prim, path) for prim, path in found if not stage.GetPrimAtPath(path)), None)
    if lost:
        raise InputError(f"its prim {lost[0].GetPath()} refers to {lost[1]}, which is not there", where=source)
    return not found


def _refuse_missing(source: Path) -> bool:
    """Return whether images are missing that have fallbacks. Raises InputError for other missing files."""
    missing = [(file.layer.parent / file.name).resolve() for file in files_of(source).missing]
    dispensable = dispensable_images(open_as_it_is(source)) if missing else set()
    needed = [path for path in missing if path not in dispensable]
    if needed:
        raise InputError(
            f"depends on {len(needed)} missing files, such as {needed[0].name!r}",
            where=source,
            do="put them where the layer looks for them",
        )
    return bool(missing)


def _anchor(folder: Path) -> None:
    """Make every asset path of the copy relative to its own layer, with "./" or "../" first.

    USD writes some relative to the copy's folder, which it finds only as long as the copy is the root layer.
    """

    def anchored(path: str, beside: Path) -> str:
        if not path or path[0] in "./":
            return path
        file = path.partition("[")[0]
        return f"./{path}" if (beside / file).exists() else os.path.relpath(folder / path, beside)

    for layer_file in sorted(folder.rglob("*")):
        if layer_file.is_file() and layer_file.suffix in LAYER_SUFFIXES:
            layer = layer_at(layer_file)  # of a copy whose source was looked into
            UsdUtils.ModifyAssetPaths(layer, partial(anchored, beside=layer_file.parent))
            layer.Save()
