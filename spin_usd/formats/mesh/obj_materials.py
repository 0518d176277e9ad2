"""The materials of an OBJ, from the MTL libraries that it names."""

from pathlib import Path

from spin_usd.files.model_root import root_of
from spin_usd.files.size_limits import MAX_TABLE
from spin_usd.formats.mesh.mtl_file import read_mtl
from spin_usd.formats.named_file import file_within
from spin_usd.formats.text_file import lines_of
from spin_usd.scene.material import Material
from spin_usd.scene.source.asset import ModelMaterial


def read_materials(
    path: Path, names: list[str], libraries: list[str]
) -> tuple[tuple[ModelMaterial, ...], tuple[str, ...]]:
    """Read a material for each of `names`, and notes. `libraries` are the arguments of the mtllib statements of `path`.

    Raises InputError that names a library and the line in it.
    """
    materials: dict[str, ModelMaterial] = {}
    notes: list[str] = []
    for library in (name for argument in libraries for name in _names(path.parent, argument)):
        file = file_within(root_of(path), path.parent, library)
        if file is None:
            notes.append(f"the material library {library!r} lies outside the model's folder and was not read")
        elif not file.is_file():
            notes.append(f"the material library {library!r} is missing")
        else:
            found, remarks = read_mtl(file, lines_of(file, MAX_TABLE), root_of(path))
            materials |= found
            notes += remarks
    missing = [name for name in names if name not in materials]
    if missing:
        notes.append(f"{len(missing)} of {len(names)} materials have no definition and are neutral grey")
    grey = {name: ModelMaterial(constants=Material(path=name)) for name in missing}
    return tuple((materials | grey)[name] for name in names), tuple(notes)


def _names(folder: Path, argument: str) -> list[str]:
    """Return the libraries that one mtllib names: one, which may have blanks in its name, or several where they are
    there."""
    words = argument.split()
    return words if not _is_there(folder, argument) and any(_is_there(folder, word) for word in words) else [argument]


def _is_there(folder: Path, named: str) -> bool:
    file = file_within(folder, folder, named)
    return file is not None and file.is_file()
