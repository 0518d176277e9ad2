"""Surroundings: layers of a stage's lights, and of its background, whose planet may have maps.

Bundled ones are in `stages/environments`; a user may give others.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from pxr import Gf, Sdf, Usd

from spin_usd.errors import InputError
from spin_usd.stage.author.paths import ENVIRONMENT, LIGHTS
from spin_usd.stage.composition.images import image_in
from spin_usd.stage.composition.open_layer import open_layer, stage_on
from spin_usd.stage.read.planet import COLOURS, colours_outside
from spin_usd.stage.usd import schema
from spin_usd.stage.usd.layer_file import author_metadata

SURROUNDING_PRIMS: Mapping[str, Sdf.Path] = {"lights": LIGHTS, "environment": ENVIRONMENT}
"""The kinds of surroundings, and their prims in an authored stage.

The default prim of a layer of lights is Lights, of an environment Environment."""
USUAL: Mapping[str, str] = {"lights": "sun", "environment": "deep_space"}
"""The layer of each kind that a stage has unless another is chosen."""
PICTURES = (".jpg", ".jpeg", ".png", ".exr")
"""The endings of files that can be a back plate or a planet's map."""
MAP_SHAPE = 1.9, 2.1  # width over height: all longitudes and latitudes, and a row or two more or less
MAP_ATTRIBUTES = {
    "albedo": schema.PLANET_ALBEDO_FILE,
    "clouds": schema.PLANET_CLOUDS_FILE,
    "night": schema.PLANET_NIGHT_FILE,
}


def open_surroundings(path: str | Path, kind: str) -> Sdf.Layer:
    """Flatten the layer at `path` into one anonymous layer, asset paths absolute.

    Raises InputError that names the file where it is not of that kind.
    """
    layer = open_layer(Path(path))
    flat = composed(layer, path)
    prim = SURROUNDING_PRIMS[kind].name
    if layer.defaultPrim != prim or not flat.GetPrimAtPath(f"/{prim}"):
        what = "layer of lights" if kind == "lights" else "layer of an environment"
        raise InputError(f"is not a {what}: its default prim is not {prim}", where=path)
    return extracted(flat, Sdf.Path(f"/{prim}"), layer.documentation)


def composed(layer: Sdf.Layer, path: str | Path) -> Sdf.Layer:
    """Flatten the layer at `path` with all that it references. Raises InputError where it does not compose."""
    stage = stage_on(layer)
    if errors := stage.GetCompositionErrors():
        raise InputError(f"does not compose: {errors[0]}", where=path)
    return stage.Flatten(addSourceFileComment=False)


def extracted(flat: Sdf.Layer, prim: Sdf.Path, documentation: str) -> Sdf.Layer:
    """Copy `prim` and all below it into a layer of its own."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_metadata(layer, default_prim=prim.name, documentation=documentation)
    Sdf.CopySpec(flat, prim, layer, Sdf.Path.absoluteRootPath.AppendChild(prim.name))
    return layer


def set_planet_maps(layer: Sdf.Layer, maps: Mapping[str, Path]) -> None:
    """Let the planet of an environment's `layer` show `maps`, files by their kind. Raises InputError for a layer
    without a planet, or with several and none that is named Earth, and for a map that cannot be rendered."""
    stage = stage_on(layer)
    planets = [prim for prim in stage.Traverse() if prim.HasAPI(schema.PLANET_API)]
    named = [prim for prim in planets if prim.GetName() == "Earth"]
    if len(planets) != 1 and len(named) != 1:
        found = f"maps of the Earth are given, and the environment has {len(planets)} planets"
        raise InputError(found, do="choose the environment earth or earth_full, or name one planet Earth")
    planet: Usd.Prim = (named or planets)[0]
    for kind, file in maps.items():
        _refuse_unless_map(file, kind)
        planet.GetAttribute(MAP_ATTRIBUTES[kind]).Set(Sdf.AssetPath(str(file.resolve())))


def refuse_damaged(files: Iterable[Path]) -> None:
    """Decode the pictures as a render will. Raises InputError for the first that cannot be rendered."""
    for file in files:
        image_in(file, "auto")


def set_back_plate(layer: Sdf.Layer, files: Sequence[Path], *, always: bool, times: Sequence[float] = ()) -> None:
    """Let the back plate of an environment's `layer` be one of the images in `files`, or each at its time code of
    `times`; `always`, upright and unchanged. Raises InputError for a layer without a back plate."""
    stage = stage_on(layer)
    plates = [prim for prim in stage.Traverse() if prim.HasAPI(schema.BACK_PLATE_API)]
    if len(plates) != 1:
        found = f"a background is given, and the environment has {len(plates)} back plates"
        raise InputError(found, do="choose the environment back_plate, or none")
    (plate,) = plates
    assets = [Sdf.AssetPath(str(file.resolve())) for file in files]
    named = plate.GetAttribute(schema.BACK_PLATE_FILES)
    named.Set(assets[:1] if times else assets)
    for time, asset in zip(times, assets, strict=False):
        named.Set([asset], time)
    if always:
        plate.GetAttribute(schema.BACK_PLATE_PROBABILITY).Set(1.0)
        plate.GetAttribute(schema.BACK_PLATE_ROLL).Set(Gf.Vec2d(0, 0))
        plate.GetAttribute(schema.BACK_PLATE_MIRROR).Set(0.0)


def _refuse_unless_map(file: Path, kind: str) -> None:
    """Decode the map like a render, to refuse an unusable one before a stage is written. Raises InputError."""
    image = image_in(file, "raw" if kind == "clouds" else "auto")
    height, width = image.size
    if not MAP_SHAPE[0] * height <= width <= MAP_SHAPE[1] * height:
        found = f"has {width} x {height} pixels, and a map in latitude and longitude is twice as wide as high"
        raise InputError(found, where=file, do="give one of the whole planet")
    attribute = MAP_ATTRIBUTES[kind]
    if attribute in COLOURS and (outside := colours_outside(image, attribute)):
        raise InputError(outside, where=file, do=f"make them {COLOURS[attribute]}")
