"""Pictures as PNG files of 8 bits."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses

from materials.values import Array


def write_textures(folder: Path, textures: Mapping[str, Callable[[], Array]]) -> None:
    """Make each picture and write it into the folder, which is made.

    Pictures are (H, W, C) float64 in 0 to 1, the top row first; st (0, 0) is the lower left corner.
    """
    folder.mkdir(exist_ok=True)
    for name, make in textures.items():
        _write(folder / name, make())


def _write(path: Path, image: Array) -> None:
    pixels = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.UINT8)
    spec.attribute("png:compressionLevel", 9)
    output = oiio.ImageOutput.create(str(path))
    if not output or not output.open(str(path), spec) or not output.write_image(pixels) or not output.close():
        raise OSError(f"{path} could not be written: {oiio.geterror()}")
