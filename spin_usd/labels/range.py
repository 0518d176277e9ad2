"""Range: how far the surface behind each pixel is from the camera, along the pixel's own ray."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import Label
from spin_usd.labels.labelled_picture import LabelFault, LabelledPicture, largest_relative_difference
from spin_usd.labels.preview import by_distance
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.surface import Surface
from spin_usd.scene.scene import Scene

RELATIVE = 1e-6  # float32 rounds to 6e-8; depth, body coordinates and pose each add as much


def range_along_ray(scene: Scene, surface: Surface) -> NDArray[np.float32]:
    """Return (H, W) float32: metres from the camera to the surface point; 0 for no surface."""
    return surface.image(surface.z * ray_lengths(surface.xy), np.float32)


def ray_lengths(xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (...) the lengths of the rays (x, y, 1) of `xy` (..., 2): the ratio of range to depth."""
    lengths: NDArray[np.float64] = np.sqrt((xy * xy).sum(-1) + 1)
    return lengths


def faults(picture: LabelledPicture) -> Iterator[LabelFault]:
    """Range is depth along each pixel's ray, and the distance of the dense pose's point from the camera."""
    array, depth = picture.arrays["range"], picture.arrays.get("depth")
    if depth is not None:
        if ((array > 0) != (depth > 0)).any():
            yield LabelFault(code="support", message="range and depth cover different pixels")
            return
        rows, columns = np.nonzero(depth)
        xy = picture.camera.normalised(np.stack([columns + 0.5, rows + 0.5], -1))
        off = largest_relative_difference(array[rows, columns], depth[rows, columns] * ray_lengths(xy))
        if not off <= RELATIVE:
            yield LabelFault(code="range", message=f"range and depth differ by {off:.3g} of the range")
    if picture.points_cam is not None:
        distance = np.linalg.norm(picture.points_cam, axis=1)
        off = largest_relative_difference(array[picture.target_pixels], distance, picture.rounding)
        if not off <= RELATIVE:
            yield LabelFault(code="range", message=f"range and dense pose differ by {off:.3g} of the range")


RANGE = Label(
    name="range",
    make=range_along_ray,
    channels=Channels(
        meaning="distance from the camera along the pixel's ray, metres: one float32 channel, Y; 0 = nothing",
        dtype="float32",
        holds={"Y": "range"},
        unit="m",
    ),
    suffix=".exr",
    usd_type="float",
    file_bytes=1.4,
    preview=by_distance,
    faults=faults,
)
