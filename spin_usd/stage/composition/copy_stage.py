"""Self-contained copies of a stage: all its files, over all variants, under one folder."""

import shutil
from pathlib import Path

from pxr import Sdf, UsdUtils

from spin_usd.errors import InputError, OutputError, StageError
from spin_usd.stage.composition.files import Files, Missing, files_of
from spin_usd.stage.composition.missing_images import dispensable_images
from spin_usd.stage.composition.open_stage import open_as_it_is


def copy_stage(path: str | Path, folder: str | Path) -> Path:
    """Copy the layer at `path` and all it depends on, over all variants, into `folder`; return the root layer there.

    Files keep their bytes, and their places below the root layer's own folder. Raises StageError for a missing file,
    OutputError where `folder` is not empty or a file cannot be copied.
    """
    files, target = files_of(path), Path(folder)
    needed = _needed(files)
    if needed:
        raise StageError(f"{needed[0]} is missing", where=path, do="add the file, or remove the reference")
    if target.is_dir() and any(target.iterdir()):
        raise OutputError("the folder is not empty", where=folder, do="give an empty one")
    for file in files.found:
        _copy(file, target / file.relative_to(files.root.parent))
    return target / files.root.name


def _needed(files: Files) -> list[Missing]:
    """List the missing files without which some part of the stage cannot be rendered."""
    dispensable = dispensable_images(open_as_it_is(files.root)) if files.missing else set()
    return [each for each in files.missing if (each.layer.parent / each.name).resolve() not in dispensable]


def copy_assets(layer: Sdf.Layer, folder: Path) -> None:
    """Copy every file that `layer` names by an absolute path into `folder`, and let it name the copies as it will find
    them from beside `folder`. Raises InputError for a file that is not there, OutputError as `copy_stage`.
    """
    copies: dict[Path, str] = {}

    def copied(path: str) -> str:
        file = Path(path)
        if not path or not file.is_file():
            raise InputError("is named by the layer and not there", where=path or layer.identifier)
        if file not in copies:
            same = sum(other.name == file.name for other in copies)
            copies[file] = f"{file.stem}_{same}{file.suffix}" if same else file.name
            _copy(file, folder / copies[file])
        return f"./{folder.name}/{copies[file]}"

    UsdUtils.ModifyAssetPaths(layer, copied)


def _copy(file: Path, copy: Path) -> None:
    try:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    except OSError as error:
        found = f"cannot be written ({error.strerror or error})"
        raise OutputError(found, where=copy, do="free some space or choose another folder") from None
