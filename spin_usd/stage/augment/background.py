"""Backgrounds: an environment that an augmentation references in place of the stage's own, or a back plate of pictures
that it has itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Usd

from spin_usd.basics.resources import bundled
from spin_usd.errors import InputError
from spin_usd.scene.environment import BackPlate
from spin_usd.stage.author.lights_and_environment import PICTURES, open_surroundings, set_back_plate
from spin_usd.stage.author.paths import ENVIRONMENT
from spin_usd.stage.composition.copy_stage import Copies, copy_assets
from spin_usd.stage.composition.images import image_in
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.read.emission import EMISSIONS
from spin_usd.stage.read.environment import colours_of
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import export
from spin_usd.stage.usd.values import value_in

SUFFIXES = (".usd", ".usda", ".usdc")
BACK_PLATE = "back_plate"  # the environment whose pictures are the back plate's
PRIM = "Background"
PHOTOGRAPHS = "photographs"


@dataclass(frozen=True, kw_only=True)
class Background:
    """The layer of an environment, to be referenced at the prim `at`."""

    file: Path
    at: str
    removed: tuple[str, ...]
    """Paths of the stage's own prims there, which it replaces."""
    pictures: tuple[Path, ...] = ()
    """Files that its back plate shows instead: one for all pictures, or one for each of the stage's, at `times`."""
    times: tuple[float, ...] = ()

    def opened(self) -> Sdf.Layer:
        """Open the environment, its asset paths absolute."""
        layer = open_surroundings(self.file, "environment")
        if self.pictures:
            set_back_plate(layer, self.pictures, always=True, times=self.times)
        return layer


def background_of(stage: Usd.Stage, given: Sequence[str], folder: Path, times: Sequence[float] = ()) -> Background:
    """Find the environment of the only name that is `given`, or in that file beside the specification in `folder`, or
    the pictures of these names there, one at each of the `times`. Raises InputError."""
    pictures = tuple(beside(folder, name) for name in given if is_picture(name))
    if len(pictures) < len(given) and times:
        do = "let it choose among pictures: give it folder, or their files as values"
        raise InputError("an environment cannot change from picture to picture", where="background", do=do)
    name = BACK_PLATE if pictures else given[0]
    if not pictures and (folder / name).is_dir():
        do = f'write {{ distribution = "choice", folder = "{name}" }} to choose among its pictures'
        raise InputError(f"{name!r} is a folder", where="background", do=do)
    file = beside(folder, name) if Path(name).suffix in SUFFIXES else bundled("environment", name)
    root = stage.GetDefaultPrim()
    if not root:
        raise InputError("the stage has no default prim to put a background on", where="background", do="name one")
    at = root.GetPath().AppendChild(ENVIRONMENT.name)
    own = stage.GetPrimAtPath(at)
    removed = tuple(str(prim.GetPath()) for prim in own.GetChildren()) if own else ()
    return Background(file=file, at=str(at), removed=removed, pictures=pictures, times=tuple(times))


def is_picture(name: str) -> bool:
    """Return whether the name is an image file's, not an environment's."""
    return Path(name).suffix.lower() in PICTURES


def photograph(file: Path) -> BackPlate:
    """Return the back plate of an augmentation that lays the picture in `file` behind. Raises InputError."""
    stage = stage_on(open_surroundings(bundled("environment", BACK_PLATE), "environment"))
    (prim,) = (prim for prim in stage.Traverse() if prim.HasAPI(schema.BACK_PLATE_API))
    radiance = value_in(prim, schema.BACK_PLATE_RADIANCE, EMISSIONS, Usd.TimeCode.Default())
    return BackPlate(path=str(prim.GetPath()), images=(image_in(file, colours_of(file.name)),), radiance=radiance)


def beside(folder: Path, given: str) -> Path:
    """Return the file or folder, which must lie in the `folder` of the specification that names it. Raises
    InputError."""
    file = folder / given
    if not file.resolve().is_relative_to(folder.resolve()):
        do = "put it into the specification's folder"
        raise InputError(f"{given!r} lies outside the specification's folder", where="background", do=do)
    return file


def compose_background(stage: Usd.Stage, background: Background) -> Sdf.Layer:
    """Compose `background` into `stage`, in its session layer, so that values can be sampled for it. Returns its layer,
    which must live as long as the stage."""
    layer = background.opened()
    _write(stage.GetSessionLayer(), background, layer.identifier)
    return layer


def write_background(layer: Sdf.Layer, background: Background, folder: Path, copies: Copies) -> None:
    """Author `background` in `layer`, a file in `folder`, into which the environment and its images are copied. copies:
    existing copies of photographs."""
    environment = background.opened()
    if background.pictures:
        copy_assets(environment, folder / PHOTOGRAPHS, copies)
        prim = _write(layer, background, None)
        Sdf.CopySpec(environment, environment.GetPrimAtPath(environment.defaultPrim).path, layer, prim.path)
        return
    name, beside_it = background.file.stem, folder / "backgrounds"
    copy_assets(environment, beside_it / name)
    export(environment, beside_it / f"{name}.usda")
    _write(layer, background, f"./{beside_it.name}/{name}.usda")


def _write(layer: Sdf.Layer, background: Background, asset: str | None) -> Sdf.PrimSpec:
    """Author the prim of the background, which refers to `asset`, in place of the stage's own; return it."""
    for path in background.removed:
        Sdf.CreatePrimInLayer(layer, path).active = False
    prim = Sdf.CreatePrimInLayer(layer, Sdf.Path(background.at).AppendChild(PRIM))
    prim.specifier = Sdf.SpecifierDef
    if asset is not None:
        prim.referenceList.prependedItems.append(Sdf.Reference(asset))
    return prim
