"""A render as a file: the target's radiance in unit light, light group by light group, of its region alone, exact.

Channels: A, the coverage, and lightNNNN.R, .G, .B of each group in the order of scene.derived.light_groups; float32.
"""

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import InputError
from spin_usd.files.folder import FileIn
from spin_usd.files.size_limits import MAX_ARRAY
from spin_usd.formats.image_file import decoded_image, encoded_image
from spin_usd.geometry.region import Region
from spin_usd.scene.passes import Radiance

RENDER_SUFFIX = ".exr"


def encoded_render(radiance: Radiance) -> bytes:
    """Return the bytes of the render as one image file. Raises OutputError, as encoded_image does."""
    rows, columns = radiance.region.shape
    lit = np.moveaxis(radiance.groups, -1, 1).reshape(3 * len(radiance.groups), rows, columns)
    planes = np.concatenate([radiance.coverage[None], lit])
    pixels = np.zeros((max(rows, 1), max(columns, 1), len(planes)), np.float32)  # an image file has at least one pixel
    pixels[:rows, :columns] = np.moveaxis(planes, 0, -1)
    return encoded_image(pixels, RENDER_SUFFIX, channels=_channels(len(radiance.groups)))


def read_render(source: FileIn, region: Region, *, groups: int) -> Radiance | None:
    """Read the render of `region` from the file `source`; None if it is not one."""
    try:
        with source.folder.open(source.name, MAX_ARRAY) as file:
            pixels, found = decoded_image(file, source.path)
    except InputError:
        return None
    rows, columns = region.shape
    names = _channels(groups)
    if pixels.dtype != np.float32 or pixels.shape[:2] != (max(rows, 1), max(columns, 1)) or {*found} != {*names}:
        return None
    planes = pixels.reshape(*pixels.shape[:2], len(names))[:rows, :columns, [found.index(name) for name in names]]
    lit: NDArray[np.float32] = planes[..., 1:].reshape(rows, columns, groups, 3)
    return in_order(Radiance(region=region, groups=np.moveaxis(lit, 2, 0), coverage=planes[..., 0]))


def in_order(radiance: Radiance) -> Radiance:
    """Return the same numbers in C order: numpy's sums round by the order in memory, and all pictures must round
    alike."""
    groups, coverage = np.ascontiguousarray(radiance.groups), np.ascontiguousarray(radiance.coverage)
    return Radiance(region=radiance.region, groups=groups, coverage=coverage)


def _channels(groups: int) -> tuple[str, ...]:
    return ("A", *(f"light{group:04d}.{colour}" for group in range(groups) for colour in "RGB"))
