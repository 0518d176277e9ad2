"""The camera of a new stage: a layer, made of what a user or an example names."""

from pathlib import Path

from spin_usd.formats.camera_file import read_camera_file
from spin_usd.resources import bundled
from spin_usd.stage.author.camera_layer import camera_layer_of, open_camera_layer
from spin_usd.stage.usd.layer_file import Layer

USD_SUFFIXES = {".usd", ".usda", ".usdc", ".usdz"}


def open_camera(given: str) -> tuple[Layer, Path, tuple[str, ...]]:
    """Open the layer of the camera of that name or in that file, the file it comes from, and notes on that. Raises
    InputError."""
    suffix = Path(given).suffix.lower()
    if suffix == ".json":
        found = read_camera_file(given)
        documentation = f"The calibration in {Path(given).name}."
        layer = camera_layer_of(found.camera, pixel_pitch=found.pixel_pitch, documentation=documentation)
        return layer, Path(given), found.notes
    path = Path(given) if suffix in USD_SUFFIXES else bundled("camera", given)
    return open_camera_layer(path), path, ()
