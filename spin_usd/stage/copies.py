"""Copies of a stage that stand alone: all its files, over all variants, under one folder."""

import shutil
from pathlib import Path

from spin_usd.errors import OutputError, StageError
from spin_usd.stage.assets import files_of


def copy_stage(path: str | Path, folder: str | Path) -> Path:
    """Copy the layer at `path` and all it depends on, over all variants, into `folder`; return the root layer there.

    Files keep their bytes, and their places below the root layer's own folder. Raises StageError for a missing file,
    OutputError where `folder` is not empty or a file cannot be copied.
    """
    files, target = files_of(path), Path(folder)
    if files.missing:
        raise StageError(f"{files.missing[0]} is missing", where=path, do="add the file, or remove the reference")
    if target.is_dir() and any(target.iterdir()):
        raise OutputError("the folder is not empty", where=folder, do="give an empty one")
    for file in files.found:
        _copy(file, target / file.relative_to(files.root.parent))
    return target / files.root.name


def _copy(file: Path, copy: Path) -> None:
    try:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    except OSError as error:
        found = f"could not be written ({error.strerror or error})"
        raise OutputError(found, where=copy, do="free some space or choose another folder") from None
