"""Where the layers and schemas that travel with the package lie: in a wheel, or at a checkout's top level."""

from collections.abc import Mapping
from pathlib import Path

from spin_usd.errors import InputError

PACKAGE = Path(__file__).resolve().parent
HEAD = 1000  # characters of a layer in which its default prim stands
BUNDLED = {
    "targets": "targets/*/*.usda",
    "cameras": "cameras/*.usda",
    "presets": "presets/*.usda",
    "lights": "environments/*.usda",
    "environments": "environments/*.usda",
    "examples": "examples/*.toml",
    "specifications": "augmentations/*.toml",
}
DEFAULT_PRIMS = {"lights": "Lights", "environments": "Environment"}
"""What tells the two kinds of layer in one folder apart."""


def stages() -> Path:
    """The folder of hand-written layers: targets, cameras, environments, augmentations, examples."""
    return _folder("stages")


def schemas() -> Path:
    """The folder of JSON Schemas and of the codeless USD schema (in `spin`)."""
    return _folder("schemas")


def bundled(kind: str) -> Mapping[str, Path]:
    """The files of that kind, one of BUNDLED, that travel with spin_usd, by their names, in alphabetical order."""
    files = sorted(stages().glob(BUNDLED[kind]))
    return {file.stem: file for file in files if _is_of(kind, file)}


def _is_of(kind: str, file: Path) -> bool:
    if kind == "targets":  # beside a target's own layer lie those that it is made of
        return file.stem == file.parent.name
    if kind in DEFAULT_PRIMS:
        return f'defaultPrim = "{DEFAULT_PRIMS[kind]}"' in file.read_text(encoding="utf-8")[:HEAD]
    return True


def _folder(name: str) -> Path:
    for folder in (PACKAGE / "data" / name, PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise InputError(f"the installation lacks its folder '{name}'", where=PACKAGE, do="install spin_usd again")
