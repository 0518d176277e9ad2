"""Several root prims of a file gathered under one, so that a stage can reference them all.

A reference includes one prim with all below it, and loses its relationships to prims elsewhere in the file.
"""

from pathlib import Path

from pxr import Sdf, Usd, UsdUtils

from spin_usd.errors import InputError
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.composition.open_stage import open_as_it_is
from spin_usd.stage.usd.layer_file import export
from spin_usd.unique_names import UniqueNames

GATHERED = "Roots"
BESIDE = "Beside"
"""The scope of the prims that are not chosen: it is invisible, but materials and prototypes in it are found."""


def gather_roots(file: Path, chosen: Sdf.Path) -> Path:
    """Write beside the stage at `file` a layer whose default prim holds the prim at `chosen` and, invisibly, all other
    root prims; or all root prims alike, where `chosen` is the absolute root. Returns its path.

    Raises InputError for a prim that cannot be moved.
    """
    absolute = file.resolve()  # so are the asset paths that USD makes in what it flattens
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
