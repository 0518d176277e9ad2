"""The back plate, an image behind everything: the choice among its images, their placement, and the pixels."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spin_usd.geometry.region import Region
from spin_usd.renderers.background.arithmetic.bilinear import bilinear, repeated
from spin_usd.renderers.background.arithmetic.elementary import Float32
from spin_usd.scene.environment import BackPlate
from spin_usd.scene.texture import Image

PLATE = 1  # separates this use of a picture's seed from others


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedImage:
    """An image as it is placed behind one picture: rotated clockwise by `roll`, radians, after it was mirrored."""

    image: Image
    roll: float
    mirrored: bool


def place_image(plate: BackPlate, seed: int) -> PlacedImage | None:
    """Return the image of the back plate that the picture with this seed shows, None where it shows none."""
    there, which, turn, mirror = np.random.default_rng([seed, PLATE]).random(4)
    if there >= plate.probability:
        return None
    least, most = plate.roll
    image = plate.images[int(which * len(plate.images))]
    return PlacedImage(image=image, roll=least + turn * (most - least), mirrored=bool(mirror < plate.mirror))


def plate_radiance(placed: PlacedImage, frame: Region, band: Region) -> list[Float32]:
    """Return R, G, B (N,) of the image behind the pixels of `band`, in the same order; 1 is white.

    The image is as small as it can be without an edge in the frame, its middle in the frame's middle.
    """
    cos, sin = np.cos(placed.roll), np.sin(placed.roll)
    wide = frame.width * abs(cos) + frame.height * abs(sin)
    high = frame.width * abs(sin) + frame.height * abs(cos)
    rows, columns = placed.image.pixels.shape[:2]
    scale = min(columns / wide, rows / high)  # of the image's pixels to the frame's
    tables = _reduced(placed.image, max(int(scale), 1))
    rows, columns = tables.shape[1] - 1, tables.shape[2] - 1
    scale = min(columns / wide, rows / high)
    x = np.arange(band.x0, band.x1) + 0.5 - frame.width / 2
    y = (np.arange(band.y0, band.y1) + 0.5 - frame.height / 2)[:, None]
    across = (x * cos + y * sin) * (-scale if placed.mirrored else scale) + columns / 2 - 0.5
    down = (y * cos - x * sin) * scale + rows / 2 - 0.5
    u, v = np.clip(across, 0, columns - 1), np.clip(down, 0, rows - 1)
    return bilinear(tables, u.ravel().astype(np.float32), v.ravel().astype(np.float32))


@lru_cache(maxsize=4)
def _reduced(image: Image, factor: int) -> Float32:
    """Return the image's R, G and B as tables, with the mean of each `factor` by `factor` pixels for one."""
    rows, columns = (size // factor for size in image.pixels.shape[:2])
    cut = image.pixels[: rows * factor, : columns * factor, :3]
    means = cut.reshape(rows, factor, columns, factor, 3).mean((1, 3), dtype=np.float32)
    return repeated(np.moveaxis(means, -1, 0))
