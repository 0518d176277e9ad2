"""Rendering one Blender scene into an array, through a float EXR in a temporary folder."""

import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO
from numpy.typing import NDArray

from spin_usd.errors import RenderError
from spin_usd.geometry.region import Region


def scratch_folder() -> tempfile.TemporaryDirectory[str]:
    """A private folder where the process keeps its temporary files: a worker's lies in the dataset, to be swept."""
    return tempfile.TemporaryDirectory(prefix="spin_usd-", ignore_cleanup_errors=True)


class Readback:
    """The way from Blender's picture to an array, through a file in the folder `scratch`."""

    def __init__(self, scratch: Path) -> None:
        self._file = scratch / "frame.exr"

    def render(self, scene: Any, region: Region) -> NDArray[np.float32]:
        """(rows, columns, 4) float32 of `region`, linear RGB premultiplied by alpha.

        Raises RenderError when Blender fails or lies about it.
        """
        self._file.unlink(missing_ok=True)
        scene.render.filepath = str(self._file)
        try:
            outcome = bpy.ops.render.render(write_still=True, scene=scene.name)
        except RuntimeError as error:
            raise RenderError(f"Blender failed: {error}") from error
        if outcome != {"FINISHED"}:
            raise RenderError(f"Blender ended a render with {sorted(outcome)}")
        return self._read(region)

    def _read(self, region: Region) -> NDArray[np.float32]:
        image = OpenImageIO.ImageInput.open(str(self._file))
        pixels = image.read_image(0, 0, 0, 4, "float") if image else None
        if image is None or pixels is None:
            error = image.geterror() if image else OpenImageIO.geterror()
            raise RenderError(f"Blender's picture cannot be read: {error}")
        image.close()
        if pixels.shape != (*region.shape, 4):
            raise RenderError(f"Blender rendered {pixels.shape[:2]} pixels where {region.shape} were wanted")
        return np.ascontiguousarray(pixels, np.float32)


def face_indices(numbers: NDArray[np.float32], count: int) -> NDArray[np.int32]:
    """Face indices (rows, columns) of the face numbers that were rendered, -1 where none.

    Raises RenderError unless each is one of the whole numbers 0 to `count`.
    """
    whole = np.rint(numbers)
    if not np.array_equal(whole, numbers) or (whole.size and not 0 <= whole.min() <= whole.max() <= count):
        raise RenderError(f"the label picture holds numbers that are no face's, expected 0 to {count}")
    return whole.astype(np.int32) - 1
