"""Maps of a planet in a layer of an environment."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf, Usd

from spin_usd.errors import InputError
from spin_usd.stage.composition.images import image_in
from spin_usd.stage.composition.open_layer import stage_on
from spin_usd.stage.composition.planet_images import COLOURS, colours_outside
from spin_usd.stage.usd import schema

SHAPE = (1.9, 2.1)  # width over height: all longitudes and latitudes, and a row or two more or less
ATTRIBUTES = {
    "albedo": schema.PLANET_ALBEDO_FILE,
    "clouds": schema.PLANET_CLOUDS_FILE,
    "night": schema.PLANET_NIGHT_FILE,
}


def set_planet_maps(layer: Sdf.Layer, maps: Mapping[str, Path]) -> None:
    """Let the planet of an environment's `layer` show `maps`, files by what they show. Raises InputError for a layer
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
        planet.GetAttribute(ATTRIBUTES[kind]).Set(Sdf.AssetPath(str(file.resolve())))


def _refuse_unless_map(file: Path, kind: str) -> None:
    """Decode the map as a render will, so that what cannot be rendered is refused before a stage is written of it.
    Raises InputError."""
    image = image_in(file, "raw" if kind == "clouds" else "auto")
    height, width = image.size
    if not SHAPE[0] * height <= width <= SHAPE[1] * height:
        found = f"has {width} x {height} pixels, and a map in latitude and longitude is twice as wide as high"
        raise InputError(found, where=file, do="give one of the whole planet")
    attribute = ATTRIBUTES[kind]
    if attribute in COLOURS and (outside := colours_outside(image, attribute)):
        raise InputError(outside, where=file, do=f"make them {COLOURS[attribute]}")
