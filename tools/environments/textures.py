"""The image files of the environments."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses

from environments.blue_marble import albedo
from environments.noise import Array
from environments.weather import clouds
from spin_usd.scene.derived import srgb

SIZE = (2048, 1024)


def pictures() -> dict[str, Callable[[], Array]]:
    """Return, by each file's name, the function that makes its numbers (H, W, C), 0 to 1."""
    return {
        "earth_albedo.jpg": lambda: srgb.encode(albedo(*SIZE)),
        "earth_clouds.jpg": lambda: clouds(*SIZE),
    }


def write_textures(folder: Path) -> None:
    """Write every texture into an existing folder."""
    for name, make in pictures().items():
        write_image(folder / name, make(), quality=80)


def write_image(path: Path, image: Array, *, quality: int) -> None:
    """Write numbers from 0 to 1 (H, W, C) as a file of 8 bits, a JPEG with that quality."""
    pixels = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.UINT8)
    spec.attribute("Compression", f"jpeg:{quality}")
    output = oiio.ImageOutput.create(str(path))
    if not output or not output.open(str(path), spec) or not output.write_image(pixels) or not output.close():
        raise OSError(f"{path} could not be written: {oiio.geterror()}")
