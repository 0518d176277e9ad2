"""Find the layers and schemas that travel with the package: in a wheel, or at a checkout's top level."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from spin_usd.errors import InputError

PACKAGE = Path(__file__).resolve().parents[1]
HEAD = 1000  # characters of a layer in which its default prim stands


@dataclass(frozen=True, kw_only=True)
class BundledKind:
    """A kind of files that travel with spin_usd."""

    pattern: str
    """Their paths below `stages`."""
    instead: str
    """Value that a user may give in place of a name."""
    default_prim: str = ""
    """Distinguishes layers of this kind from others in their folder; "" where all are of this kind."""


BUNDLED: Mapping[str, BundledKind] = {
    "target": BundledKind(pattern="targets/*/*.usda", instead="a model file"),
    "camera": BundledKind(pattern="cameras/*.usda", instead="a camera file"),
    "preset": BundledKind(pattern="presets/*.usda", instead="a preset layer"),
    "lights": BundledKind(pattern="environments/*.usda", instead="a layer", default_prim="Lights"),
    "environment": BundledKind(pattern="environments/*.usda", instead="a layer", default_prim="Environment"),
    "lidar": BundledKind(pattern="lidars/*.toml", instead="a LiDAR file"),
    "material": BundledKind(pattern="materials/*.usda", instead="keep"),
    "scenario": BundledKind(pattern="scenarios/*.toml", instead="a .toml file"),
    "sample": BundledKind(pattern="examples/*.toml", instead="a .toml file, or text such as range=3..10"),
    "specification": BundledKind(pattern="augmentations/*.toml", instead="a .toml file"),
}


def stages() -> Path:
    """Return the folder of hand-written layers: targets, cameras, environments, augmentations, examples."""
    return _folder("stages")


def schemas() -> Path:
    """Return the folder of JSON Schemas and of the codeless USD schema (in `spin`)."""
    return _folder("schemas")


def bundled_names(kind: str) -> tuple[str, ...]:
    """Return the names of the files of that kind, one of BUNDLED, that travel with spin_usd, in alphabetical order."""
    return tuple(file.stem for file in _files(kind))


def bundled(kind: str, name: str) -> Path:
    """Return the file of that kind, one of BUNDLED, that travels with spin_usd by that name.

    Raises InputError that lists the names there are.
    """
    files = {file.stem: file for file in _files(kind)}
    if name not in files:
        found = f"there {'are' if kind == 'lights' else 'is'} no {kind} named {name!r}"
        if Path(name).is_file():
            found = f"{name!r} is a file that cannot be {BUNDLED[kind].instead}, to go by its ending"
        raise InputError(found, do=f"name one of {', '.join(files)}, or {BUNDLED[kind].instead}")
    return files[name]


def _files(kind: str) -> Iterator[Path]:
    files = sorted(stages().glob(BUNDLED[kind].pattern))
    return (file for file in files if _is_of(kind, file))


def _is_of(kind: str, file: Path) -> bool:
    if kind == "target":  # a target's further layers lie beside its own
        return file.stem == file.parent.name
    default_prim = BUNDLED[kind].default_prim
    return not default_prim or f'defaultPrim = "{default_prim}"' in file.read_text(encoding="utf-8")[:HEAD]


def _folder(name: str) -> Path:
    for folder in (PACKAGE / "data" / name, PACKAGE.parent / name):
        if folder.is_dir():
            return folder
    raise InputError(f"the installation lacks its folder '{name}'", where=PACKAGE, do="install spin_usd again")
