"""Several root prims of a file under one, so that a stage can refer to them together.

A reference brings one prim with what is below it, and loses what that refers to elsewhere in the file.
"""

from pathlib import Path

from pxr import Sdf, Usd, UsdUtils

from spin_usd.errors import InputError
from spin_usd.stage.usd.layer_file import export

TOGETHER = "Roots"
BESIDE = "Beside"
"""The scope of what is not chosen: it is not rendered, but materials and prototypes there are found."""


def gather_roots(file: Path, chosen: Sdf.Path) -> Path:
    """Write beside the stage at `file` a layer whose default prim holds the prim at `chosen` and, invisibly, all other
    root prims; or all root prims alike, where `chosen` is the absolute root. Returns where it lies.

    Raises InputError for a prim that cannot be moved.
    """
    absolute = file.resolve()  # so are the asset paths that USD makes in what it flattens
    layer = UsdUtils.FlattenLayerStack(Usd.Stage.Open(str(absolute)))
    UsdUtils.ModifyAssetPaths(layer, lambda path: _beside(path, absolute.parent))
    roots = [prim.path for prim in layer.rootPrims]
    together = Sdf.Path.absoluteRootPath.AppendChild(_free_name(TOGETHER, roots))
    _define(layer, together, "Xform")
    stage = Usd.Stage.Open(layer)
    place = together
    if chosen != Sdf.Path.absoluteRootPath:
        _move(stage, chosen, together, file)
        place = together.AppendChild(_free_name(BESIDE, [chosen]))
        visibility = Sdf.AttributeSpec(_define(layer, place, "Scope"), "visibility", Sdf.ValueTypeNames.Token)
        visibility.default = "invisible"
    for root in roots:
        if root != chosen:
            _move(stage, root, place, file)
    layer.defaultPrim = together.name
    gathered = file.with_name(f"{file.stem}_roots.usdc")
    export(layer, gathered)
    return gathered


def _beside(path: str, folder: Path) -> str:
    """An absolute asset path, or one into a package, as a layer in `folder` names it."""
    return f"./{Path(path).relative_to(folder).as_posix()}" if path.startswith(f"{folder}/") else path


def _free_name(name: str, taken: list[Sdf.Path]) -> str:
    names = {path.name for path in taken}
    return next(free for n in range(len(names) + 1) if (free := f"{name}_{n}" if n else name) not in names)


def _define(layer: Sdf.Layer, path: Sdf.Path, kind: str) -> Sdf.PrimSpec:
    spec = Sdf.CreatePrimInLayer(layer, path)
    spec.specifier, spec.typeName = Sdf.SpecifierDef, kind
    return spec


def _move(stage: Usd.Stage, path: Sdf.Path, below: Sdf.Path, file: Path) -> None:
    """Move a prim, and let all that refers to it follow."""
    editor = Usd.NamespaceEditor(stage)
    if not editor.MovePrimAtPath(path, below.AppendChild(path.name)) or not editor.ApplyEdits():
        raise InputError(
            f"its prim {path} cannot be moved", where=file.name, do="author a defaultPrim that holds it all"
        )
