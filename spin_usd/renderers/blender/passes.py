"""Rendering one Blender scene into arrays, through a float EXR in a temporary folder."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenImageIO
from numpy.typing import NDArray

from spin_usd.errors import RenderError
from spin_usd.geometry.region import Region
from spin_usd.renderers.blender.cycles_settings import IMAGE, LAYERS
from spin_usd.renderers.blender.nodes import assign

Float32 = NDArray[np.float32]

COMBINED = "Combined"


def scratch_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a private folder where the process keeps its temporary files: a worker's lies in the dataset, to be
    swept."""
    return tempfile.TemporaryDirectory(prefix="spin_usd-", ignore_cleanup_errors=True)


class Readback:
    """Reads Blender's pictures as arrays, through a file in the folder `scratch`.

    Raises RenderError when Blender fails, or reports a success that is not one.
    """

    def __init__(self, scratch: Path) -> None:
        self._file = scratch / "frame.exr"

    def picture(self, scene: Any, region: Region) -> Float32:
        """Return (rows, columns, 4) float32 of `region`, linear RGB premultiplied by alpha."""
        return self._passes(scene, region, IMAGE, {"": 4})[""]

    def planes(self, scene: Any, region: Region, passes: Sequence[str]) -> tuple[Float32, Float32]:
        """Return the view layer's `passes` (N, rows, columns, 3) of `region`, and the coverage (rows, columns)."""
        if not passes:  # coverage alone: a smaller file
            return np.zeros((0, *region.shape, 3), np.float32), self.picture(scene, region)[..., 3]
        found = self._passes(scene, region, LAYERS, {**dict.fromkeys(passes, 3), COMBINED: 4})
        return np.stack([found[name][..., :3] for name in passes]), found[COMBINED][..., 3]

    def _passes(
        self, scene: Any, region: Region, kind: Mapping[str, Any], wanted: Mapping[str, int]
    ) -> dict[str, Float32]:
        assign(scene.render.image_settings, kind)
        scene.render.filepath = str(self._file)
        render(scene, self._file, write_still=True)
        return read_picture(self._file, region.shape, wanted)


def render(scene: Any, file: Path, *, write_still: bool) -> None:
    """Let Blender make `file` from the `scene`: its still picture, or its compositor's output."""
    file.unlink(missing_ok=True)
    try:
        outcome = bpy.ops.render.render(write_still=write_still, scene=scene.name)
    except RuntimeError as error:
        raise RenderError(f"Blender failed: {error}") from error
    if outcome != {"FINISHED"}:
        raise RenderError(f"Blender ended a render with {sorted(outcome)}")


def read_picture(file: Path, shape: tuple[int, int], wanted: Mapping[str, int]) -> dict[str, Float32]:
    """Return (*shape, channels) float32 of each pass that is `wanted`, with the channels given."""
    image = OpenImageIO.ImageInput.open(str(file))
    if image is None:
        raise RenderError(f"Blender's picture cannot be read: {OpenImageIO.geterror()}")
    found = {}
    for part in range(image.spec().get_int_attribute("oiio:subimages", 1)):
        image.seek_subimage(part, 0)
        name = _pass_name(image.spec().channelnames[0])
        if name in wanted:
            found[name] = _pixels(image, part, (*shape, wanted[name]))
    image.close()
    if missing := set(wanted) - set(found):
        raise RenderError(f"Blender's picture lacks the passes {sorted(missing)}")
    return found


def _pixels(image: Any, part: int, shape: tuple[int, int, int]) -> Float32:
    pixels = image.read_image(part, 0, 0, shape[2], "float")
    if pixels is None:
        raise RenderError(f"Blender's picture cannot be read: {image.geterror()}")
    if pixels.shape != shape:
        raise RenderError(f"Blender rendered {pixels.shape[:2]} pixels where {shape[:2]} were wanted")
    return np.ascontiguousarray(pixels, np.float32)


def _pass_name(channel: str) -> str:
    """Return the name of the pass of a channel "layer.pass.R"; "" for a picture of one layer, whose channel is "R"."""
    return channel.rpartition(".")[0].partition(".")[2]


def face_indices(numbers: Float32, count: int) -> NDArray[np.int32]:
    """Face indices (rows, columns) of the face numbers that were rendered, -1 where none.

    Raises RenderError unless each is one of the whole numbers 0 to `count`.
    """
    whole = np.rint(numbers)
    if not np.array_equal(whole, numbers) or (whole.size and not 0 <= whole.min() <= whole.max() <= count):
        raise RenderError(f"the label picture holds numbers of no face, expected 0 to {count}")
    return whole.astype(np.int32) - 1
