"""A USD target, given as a file or by the name of one that travels with spin_usd, copied with all it depends on."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MappingProxyType

from pxr import Sdf, Usd, UsdUtils

from spin_usd.basics.unique_names import UniqueNames
from spin_usd.errors import InputError
from spin_usd.stage.author.target_asset import TargetAsset, describe, open_source, select_variants
from spin_usd.stage.author.target_root import notes_on_root, outside, target_root
from spin_usd.stage.composition.files import LAYERS, files_of
from spin_usd.stage.composition.materialx import composition_errors
from spin_usd.stage.composition.missing_images import dispensable_images, files_of_others
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.composition.open_stage import open_as_it_is, silenced
from spin_usd.stage.usd.layer_file import export, layer_at, writing
from spin_usd.stage.usd.parser_faults import parser_faults

LAYER_SUFFIXES = {".usd", ".usda", ".usdc"}
GATHERED = "Roots"
BESIDE = "Beside"
"""The scope of the prims that are not chosen: it is invisible, but materials and prototypes in it are found."""


def copy_usd_target(
    source: Path,
    folder: Path,
    name: str,
    units_per_metre: float | None,
    prim: str | None = None,
    variants: Mapping[str, str] = MappingProxyType({}),
) -> TargetAsset:
    """Copy the asset at `source` with all it depends on into `folder`, which must not exist yet. `prim` is the path of
    the target in it, if not the default prim; `variants` are selected by their sets.

    Raises InputError that names the file, OutputError when the copy cannot be written.
    """
    with silenced(), parser_faults(source), slashes(source):
        incomplete, left_out = _refuse_missing(source)
        stage = open_source(source)
        root = target_root(stage, source, prim)
        alone = _stands_alone(stage, source, root)
        with writing(folder):
            folder.mkdir(parents=True)
            copied = UsdUtils.LocalizeAsset(Sdf.AssetPath(str(source)), str(folder))
            _anchor(folder, left_out)
        file = folder / source.resolve().name
        if not (copied or incomplete) or composition_errors(open_as_it_is(file)):
            raise InputError("cannot be copied with its dependencies", where=source)
        if variants:
            if file.suffix.lower() not in LAYER_SUFFIXES:
                raise InputError("is a package, of which no variant can be selected", where=source, do="unpack it")
            layer = layer_at(file)
            edited = stage_on(layer)
            select_variants(edited.GetPrimAtPath(root), variants, source)
            layer.Save()
        if not alone:
            file = gather_roots(file, root)
        chosen = str(root) if alone and root != stage.GetDefaultPrim().GetPath() else None
        others = f"files that only shaders of other renderers name are missing, and left out: {', '.join(left_out)}"
        remarks = [others] if left_out else []
        found = describe(file, name, units_per_metre, prim=chosen, source=source)
        return replace(found, source_prim=str(root), notes=(*notes_on_root(stage, root, prim), *remarks))


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


def _refuse_missing(source: Path) -> tuple[bool, list[str]]:
    """Return whether files are missing that we do not need, images with fallbacks and files only for other renderers,
    and the names of the latter. Raises InputError for other missing files."""
    missing = [(file.layer.parent / file.name).resolve() for file in files_of(source).missing]
    stage = open_as_it_is(source) if missing else None
    dispensable, foreign = (dispensable_images(stage), files_of_others(stage)) if stage else (set(), set())
    needed = [path for path in missing if path not in dispensable | foreign]
    if needed:
        raise InputError(
            f"depends on {len(needed)} missing files, such as {needed[0].name!r}",
            where=source,
            do="put them where the layer looks for them",
        )
    return bool(missing), sorted({path.name for path in missing if path in foreign - dispensable})


def _anchor(folder: Path, left_out: list[str]) -> None:
    """Make every asset path of the copy relative to its own layer, with "./" or "../" first, and remove those to
    missing files of a name in `left_out`.

    USD writes some relative to the copy's folder, which it finds only as long as the copy is the root layer.
    """

    def anchored(path: str, beside: Path) -> str:
        if Path(path).name in left_out and not (beside / path).exists():
            return ""
        if not path or path[0] in "./":
            return path
        file = path.partition("[")[0]
        return f"./{path}" if (beside / file).exists() else os.path.relpath(folder / path, beside)

    for layer_file in sorted(folder.rglob("*")):
        if layer_file.is_file() and layer_file.suffix in LAYER_SUFFIXES:
            layer = layer_at(layer_file)  # of a copy whose source was looked into
            UsdUtils.ModifyAssetPaths(layer, partial(anchored, beside=layer_file.parent))
            layer.Save()


def gather_roots(file: Path, chosen: Sdf.Path) -> Path:
    """Write beside the stage at `file` a layer whose default prim holds the prim at `chosen` and, invisibly, all other
    root prims; or all root prims alike, where `chosen` is the absolute root. Returns its path.

    A stage can reference them all through it. A reference includes one prim with all below it, and loses its
    relationships to prims elsewhere in the file. Raises InputError for a prim that cannot be moved.
    """
    absolute = file.resolve()  # so are the asset paths that USD makes while flattening
    layer = UsdUtils.FlattenLayerStack(open_as_it_is(absolute))
    UsdUtils.ModifyAssetPaths(layer, lambda path: _beside(path, absolute.parent))
    roots = [prim.path for prim in layer.rootPrims]
    gathered_prim = Sdf.Path.absoluteRootPath.AppendChild(_free_name(GATHERED, roots))
    _define(layer, gathered_prim, "Xform")
    stage = stage_on(layer)
    parent = gathered_prim
    if chosen != Sdf.Path.absoluteRootPath:
        _move(stage, chosen, gathered_prim, file)
        parent = gathered_prim.AppendChild(_free_name(BESIDE, [chosen]))
        visibility = Sdf.AttributeSpec(_define(layer, parent, "Scope"), "visibility", Sdf.ValueTypeNames.Token)
        visibility.default = "invisible"
    for root in roots:
        if root != chosen:
            _move(stage, root, parent, file)
    layer.defaultPrim = gathered_prim.name
    gathered = file.with_name(f"{file.stem}_roots.usdc")
    export(layer, gathered)
    return gathered


def _beside(path: str, folder: Path) -> str:
    """Make an absolute asset path, or one into a package, relative to a layer in `folder`."""
    return f"./{Path(path).relative_to(folder).as_posix()}" if path.startswith(f"{folder}/") else path


def _free_name(name: str, taken: list[Sdf.Path]) -> str:
    return UniqueNames(first=1, cased=True, taken=[path.name for path in taken]).give(name)


def _define(layer: Sdf.Layer, path: Sdf.Path, kind: str) -> Sdf.PrimSpec:
    spec = Sdf.CreatePrimInLayer(layer, path)
    spec.specifier, spec.typeName = Sdf.SpecifierDef, kind
    return spec


def _move(stage: Usd.Stage, path: Sdf.Path, below: Sdf.Path, file: Path) -> None:
    """Move a prim, and change all paths that refer to it."""
    editor = Usd.NamespaceEditor(stage)
    if not editor.MovePrimAtPath(path, below.AppendChild(path.name)) or not editor.ApplyEdits():
        raise InputError(
            f"its prim {path} cannot be moved", where=file.name, do="author a defaultPrim that holds it all"
        )


@contextmanager
def slashes(source: Path) -> Iterator[None]:
    """Within this context, and in memory only, replace backslashes by slashes in asset paths of all layers that
    `source` depends on, where the file exists. Raises StageError like `files_of`, for the files named before and
    after."""
    changed: list[Sdf.Layer] = []
    while more := [layer for layer in _layers(source) if _fix(layer)]:
        changed += more  # the files they name now may name others
    try:
        yield
    finally:
        for layer in changed:
            layer.Reload(force=True)


def _layers(source: Path) -> list[Sdf.Layer]:
    files = (file for file in files_of(source).found if file.suffix.lower() in LAYERS)
    return [layer_at(file) for file in files]


def _fix(layer: Sdf.Layer) -> bool:
    folder, found = Path(layer.realPath).parent, []

    def slashed(path: str) -> str:
        other = path.replace("\\", "/")
        tiles = path.replace("<UDIM>", "[1-9][0-9][0-9][0-9]")
        if tiles != path and path[0] not in "./" and any(folder.glob(tiles)):
            found.append(path)  # USD would use the first layer's for all
            return f"./{other}"
        if other == path or (folder / path).exists() or not (folder / other).is_file():
            return path
        found.append(path)
        return other

    UsdUtils.ModifyAssetPaths(layer, slashed)
    return bool(found)
