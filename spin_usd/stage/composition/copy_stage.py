"""Self-contained copies of a stage: all its files, over all variants, under one folder."""

import shutil
from dataclasses import dataclass, field
from pathlib import Path

from pxr import Sdf, UsdUtils

from spin_usd.basics.unique_names import UniqueNames
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


@dataclass
class Copies:
    """The names of files in a folder of copies, by their originals."""

    names: dict[Path, str] = field(default_factory=dict)
    _unique: UniqueNames = field(default_factory=lambda: UniqueNames(first=1), init=False)

    def add(self, file: Path) -> str:
        """Return a name for the copy of another file."""
        self.names[file] = self._unique.give(file.stem, file.suffix)
        return self.names[file]


def copy_assets(layer: Sdf.Layer, folder: Path, copies: Copies | None = None) -> None:
    """Copy every file that `layer` names by an absolute path into `folder`, and let it name the copies by paths from
    beside `folder`; `copies`: existing copies, to which new ones are added. Raises InputError for a missing file,
    OutputError like `copy_stage`.
    """
    copies = copies or Copies()

    def copied(path: str) -> str:
        file = Path(path)
        if not path or not file.is_file():
            raise InputError("is named by the layer and not there", where=path or layer.identifier)
        if file not in copies.names:
            _copy(file, folder / copies.add(file))
        return f"./{folder.name}/{copies.names[file]}"

    UsdUtils.ModifyAssetPaths(layer, copied)


def _copy(file: Path, copy: Path) -> None:
    try:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    except OSError as error:
        found = f"cannot be written ({error.strerror or error})"
        raise OutputError(found, where=copy, do="free some space or choose another folder") from None
