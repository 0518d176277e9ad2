"""Backgrounds: an environment that an augmentation references in place of the stage's own."""

from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Usd

from spin_usd.errors import InputError
from spin_usd.resources import bundled
from spin_usd.stage.author.lights_and_environment import open_surroundings
from spin_usd.stage.author.paths import ENVIRONMENT
from spin_usd.stage.composition.copy_stage import copy_assets
from spin_usd.stage.usd.layer_file import export

SUFFIXES = (".usd", ".usda", ".usdc")
PRIM = "Background"


@dataclass(frozen=True, kw_only=True)
class Background:
    """The layer of an environment, to be referenced at the prim `at`. removed: paths of the stage's own prims there,
    which it replaces."""

    file: Path
    at: str
    removed: tuple[str, ...]


def background_of(stage: Usd.Stage, given: str, folder: Path) -> Background:
    """Find the environment of that name, or in that file beside the specification in `folder`. Raises InputError."""
    file = _beside(folder, given) if Path(given).suffix in SUFFIXES else bundled("environment", given)
    root = stage.GetDefaultPrim()
    if not root:
        raise InputError("the stage has no default prim to put a background on", where="background", do="name one")
    at = root.GetPath().AppendChild(ENVIRONMENT.name)
    own = stage.GetPrimAtPath(at)
    removed = tuple(str(prim.GetPath()) for prim in own.GetChildren()) if own else ()
    return Background(file=file, at=str(at), removed=removed)


def _beside(folder: Path, given: str) -> Path:
    """Return the file, which must lie in the `folder` of the specification that names it."""
    file = folder / given
    if not file.resolve().is_relative_to(folder.resolve()):
        do = "put it into the specification's folder"
        raise InputError(f"{given!r} lies outside the specification's folder", where="background", do=do)
    return file


def compose_background(stage: Usd.Stage, background: Background) -> Sdf.Layer:
    """Compose `background` into `stage`, in its session layer, so that values can be sampled for it. Returns its layer,
    which must live as long as the stage."""
    layer = open_surroundings(background.file, "environment")
    _write(stage.GetSessionLayer(), background, layer.identifier)
    return layer


def write_background(layer: Sdf.Layer, background: Background, folder: Path) -> None:
    """Author `background` in `layer`, a file beside `folder`, into which the environment and its images are copied."""
    environment = open_surroundings(background.file, "environment")
    name = background.file.stem
    copy_assets(environment, folder / name)
    export(environment, folder / f"{name}.usda")
    _write(layer, background, f"./{folder.name}/{name}.usda")


def _write(layer: Sdf.Layer, background: Background, asset: str) -> None:
    for path in background.removed:
        Sdf.CreatePrimInLayer(layer, path).active = False
    prim = Sdf.CreatePrimInLayer(layer, Sdf.Path(background.at).AppendChild(PRIM))
    prim.specifier = Sdf.SpecifierDef
    prim.referenceList.prependedItems.append(Sdf.Reference(asset))
