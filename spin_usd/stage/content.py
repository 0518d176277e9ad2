"""What a composed stage says, apart from where it lies: its hash, its files, and copies of it."""

import hashlib
import shutil
from collections.abc import Sequence
from pathlib import Path

from pxr import Ar, Sdf, Usd, UsdUtils

from spin_usd.arrays import digest
from spin_usd.errors import OutputError, StageError
from spin_usd.stage.assets import files_of

AUGMENTATION = "augmentation"
NOMINAL = "nominal"


def selected_variant(stage: Usd.Stage) -> str:
    """The selection of the default prim's augmentation; "nominal" where there is none."""
    prim = stage.GetDefaultPrim()
    return (prim.GetVariantSet(AUGMENTATION).GetVariantSelection() if prim else "") or NOMINAL


def stage_hash(stage: Usd.Stage) -> str:
    """sha256 (hex) of the composed content, its assets' bytes and the selected variant.

    It does not depend on where the stage lies or how it is split into layers, and ignores variants not selected.
    """
    flat = stage.Flatten(addSourceFileComment=False)
    UsdUtils.ModifyAssetPaths(flat, lambda path: f"sha256:{_asset_sha256(path)}" if path else path)
    return digest([selected_variant(stage), flat.ExportToString()])


def used_files(stage: Usd.Stage, root: str | Path) -> dict[str, str]:
    """Path relative to `root` -> sha256 (hex) of every layer and asset that this composition uses, in order."""
    folder = Path(root).resolve()
    paths = [layer.realPath for layer in stage.GetUsedLayers() if not layer.anonymous]

    def note(path: str) -> str:
        paths.append(path)
        return path

    UsdUtils.ModifyAssetPaths(stage.Flatten(addSourceFileComment=False), note)
    files = sorted({file for path in paths if path for file in _resolved(path)})
    return {_relative(file, folder): _sha256(file) for file in files}


def copy_stage(path: str | Path, folder: str | Path, *, asset_roots: Sequence[str | Path] = ()) -> Path:
    """Copy the layer at `path` and all it depends on, over all variants, into `folder`; return the root layer there.

    Files within the root layer's own folder keep their bytes and places. A stage that also uses `asset_roots` is
    rewritten to relative paths. Raises StageError for a missing file, OutputError where `folder` is not empty.
    """
    files, target = files_of(path, asset_roots), Path(folder)
    if files.missing:
        raise StageError(f"{files.missing[0]} is missing", where=path, do="add the file, or remove the reference")
    if target.exists() and any(target.iterdir()):
        raise OutputError("the folder is not empty", where=folder, do="give an empty one")
    home = files.root.parent
    if files.absolute or not all(file.is_relative_to(home) for file in files.found):
        return _localised(files.root, target)
    for file in files.found:
        copy = target / file.relative_to(home)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    return target / files.root.name


def _localised(root: Path, target: Path) -> Path:
    target.mkdir(parents=True, exist_ok=True)
    if not UsdUtils.LocalizeAsset(Sdf.AssetPath(str(root)), str(target)):
        raise OutputError("USD could not copy the stage there", where=target, do=f"check the layers of {root}")
    return target / root.name


def _resolved(path: str) -> list[Path]:
    """The files an absolute asset path stands for: the package of what lies in one, several for <UDIM>, or none."""
    outer = Path(Ar.SplitPackageRelativePathOuter(path)[0])
    if "<UDIM>" in outer.name:
        return sorted(outer.parent.glob(outer.name.replace("<UDIM>", "[0-9][0-9][0-9][0-9]")))
    return [outer] if outer.is_file() else []


def _asset_sha256(path: str) -> str:
    inner = Ar.SplitPackageRelativePathOuter(path)[1]
    files = _resolved(path)
    return digest([[_sha256(file) for file in files], inner]) if files else f"missing {Path(path).name}"


def _sha256(file: Path) -> str:
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _relative(file: Path, folder: Path) -> str:
    real = file.resolve()
    return real.relative_to(folder).as_posix() if real.is_relative_to(folder) else real.as_posix()
