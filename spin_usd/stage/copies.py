"""Copies of a stage that stand alone: all its files, over all variants, under one folder."""

import os
import shutil
from collections.abc import Sequence
from pathlib import Path

from pxr import Sdf, UsdUtils

from spin_usd.errors import OutputError, StageError
from spin_usd.stage.assets import LAYERS, files_of

EXTERNAL = "_external"


def copy_stage(path: str | Path, folder: str | Path, *, asset_roots: Sequence[str | Path] = ()) -> Path:
    """Copy the layer at `path` and all it depends on, over all variants, into `folder`; return the root layer there.

    Files keep their bytes, and their places below the root layer's own folder. Files of `asset_roots` come to lie under
    `folder`/_external, and the layers that name them are rewritten. Raises StageError for a missing file, OutputError
    where `folder` is not empty.
    """
    files, target = files_of(path, asset_roots), Path(folder)
    if files.missing:
        raise StageError(f"{files.missing[0]} is missing", where=path, do="add the file, or remove the reference")
    if target.exists() and any(target.iterdir()):
        raise OutputError("the folder is not empty", where=folder, do="give an empty one")
    places = {files.root.parent: target}
    for number, root in enumerate(Path(root).resolve() for root in asset_roots):
        places.setdefault(root, target / EXTERNAL / str(number))
    for file in files.found:
        copy = _place(file, places)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    for file in files.found if len(places) > 1 else ():
        if file.suffix.lower() in LAYERS:
            _redirect(file, places)
    return target / files.root.name


def _place(file: Path, places: dict[Path, Path]) -> Path:
    """Where the copy of `file` lies: the first of `places` that holds it decides."""
    root = next(root for root in places if file.is_relative_to(root))
    return places[root] / file.relative_to(root)


def _redirect(layer: Path, places: dict[Path, Path]) -> None:
    """Let the copy of `layer` name the copies of the files that `layer` names; its bytes stay where they already do."""
    copy = _place(layer, places)

    def redirected(named: str) -> str:
        outer, bracket, inner = named.partition("[")
        file = Path(os.path.normpath(layer.parent / outer))
        there = os.path.relpath(_place(file, places), copy.parent)
        same = os.path.normpath(outer) == there
        return named if not named or same else f"./{Path(there).as_posix()}{bracket}{inner}"

    if all(redirected(named) == named for kind in UsdUtils.ExtractExternalReferences(str(copy)) for named in kind):
        return
    changed = Sdf.Layer.FindOrOpen(str(copy))
    UsdUtils.ModifyAssetPaths(changed, redirected)
    if not changed.Save():
        raise OutputError("USD could not write the layer", where=copy, do="check that the disk has room")
