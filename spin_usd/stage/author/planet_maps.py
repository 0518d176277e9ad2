"""Maps of a planet in a layer of an environment."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf, Usd

from spin_usd.errors import InputError
from spin_usd.stage.composition.images import image_in
from spin_usd.stage.composition.open_layer import stage_on
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
    pixels = image_in(file, "raw" if kind == "clouds" else "auto").pixels[..., :3]
    height, width, _ = pixels.shape
    if not SHAPE[0] * height <= width <= SHAPE[1] * height:
        found = f"has {width} x {height} pixels, and a map in latitude and longitude is twice as wide as high"
        raise InputError(found, where=file, do="give one of the whole planet")
    if kind == "albedo" and not 0 <= pixels.min() <= pixels.max() <= 1:
        found = f"is not an albedo: it holds numbers from {pixels.min():.3g} to {pixels.max():.3g}"
        raise InputError(found, where=file, do="scale it to shares of light, 0 to 1")
    if kind == "night" and pixels.min() < 0:
        raise InputError(f"holds lights from {pixels.min():.3g}, below 0", where=file, do="make them 0")
