"""Depth: planar z of the surface behind each pixel."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture, largest_relative_difference
from spin_usd.labels.preview import by_distance
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene

RELATIVE = 1e-6  # float32 rounds to 6e-8; body coordinates and pose each add as much


def depth(scene: Scene, surface: Surface) -> NDArray[np.float32]:
    """Return (H, W) float32: z in the camera's frame, metres; 0 for no surface."""
    return surface.image(surface.z, np.float32)


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Depth covers the segmentation's pixels, and is the z of the dense pose's points."""
    array, ids = picture.arrays["depth"], picture.arrays.get("segmentation")
    if ids is not None and ((ids > 0) != (array > 0)).any():
        yield LabelFault(code="support", message="segmentation and depth cover different pixels")
    if picture.points_cam is not None:
        off = largest_relative_difference(array[picture.target_pixels], picture.points_cam[:, 2], picture.rounding)
        if not off <= RELATIVE:
            yield LabelFault(code="depth", message=f"depth and dense pose differ by {off:.3g} of the range")


DEPTH = Label(
    name="depth",
    make=depth,
    channels=Channels(
        meaning="planar z in the camera's frame, metres: one float32 channel, Y; 0 = nothing",
        dtype="float32",
        holds={"Y": "z"},
        unit="m",
        frame="cam",
    ),
    suffix=".exr",
    usd_type="float",
    file_bytes=1.3,
    preview=by_distance,
    faults=faults,
    default=True,
)
