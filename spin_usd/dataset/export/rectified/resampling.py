"""Resampling: a picture of a camera with lens distortion, as the same camera would take it without.

Each pixel of the new picture looks along its own ray, and takes what the old picture has there. Images are interpolated
between the centres of four pixels. Labels are looked up in the pixel that the ray falls in, for a mean of two part ids
or of depths before and behind an edge is neither: so their outlines are off by up to half a pixel.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.arrays import Float
from spin_usd.geometry.camera import Camera

Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True, eq=False)
class Resampling:
    """Where the pixels of a camera without distortion lie in the picture of one with it.

    pinhole: the camera without · uv (H, W, 2) float64: pixels in the old picture, (0, 0) being its corner; 0 where
    there are none · covered (H, W): whether the old picture shows what the pixel sees; the lens may leave corners
    empty.
    """

    pinhole: Camera
    uv: Float
    covered: NDArray[np.bool_]

    def nearest(self, old: Array) -> Array:
        """Return (H, W, ...) of the pixels of `old` (H, W, ...) that hold the places; 0 where it shows nothing."""
        return self._placed(_flat(old).take(self._holding, axis=0), old)

    def interpolated(self, old: Array) -> Array:
        """Return (H, W, ...) of whole numbers, bilinear between the pixel centres of `old` (H, W, ...); 0 where it
        shows nothing. Beyond the outermost centres, up to the rim, the outermost pixels go on."""
        first, right, down = self._between
        beside, below = (1 if old.shape[1] > 1 else 0), (old.shape[1] if len(old) > 1 else 0)
        flat = _flat(old)
        share = (slice(None), *[None] * (flat.ndim - 1))
        found = np.zeros((len(first), *flat.shape[1:]), np.float32)
        for step, weight in (
            (0, (1 - right) * (1 - down)),
            (beside, right * (1 - down)),
            (below, (1 - right) * down),
            (below + beside, right * down),
        ):
            found += weight[share] * flat.take(first + step, axis=0)
        return self._placed(np.rint(found).astype(old.dtype), old)

    @cached_property
    def _holding(self) -> NDArray[np.int32]:
        """(H * W,) the number of the pixel, row by row, that holds each place."""
        column, row = self.uv.reshape(-1, 2).astype(np.int32).T
        return row * np.int32(self.pinhole.width) + column

    @cached_property
    def _between(self) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
        """(H * W,) the number of the upper left one of the four pixels around each place, and the shares of the right
        and of the lower ones."""
        size = np.array([self.pinhole.width, self.pinhole.height])
        place = np.clip(self.uv.reshape(-1, 2) - 0.5, 0, size - 1)
        first = np.minimum(place.astype(np.int32), np.maximum(size - 2, 0)).astype(np.int32)
        right, down = (place - first).astype(np.float32).T
        return first[:, 1] * np.int32(size[0]) + first[:, 0], right, down

    def _placed(self, pixels: Array, old: Array) -> Array:
        """Return the pixels (H * W, ...) as a picture shaped as `old`, without those that nothing is known of."""
        new: Array = pixels.reshape(old.shape)
        new[~self.covered] = 0
        return new


@lru_cache(maxsize=1)
def resampling(camera: Camera) -> Resampling:
    """Return how a picture of the camera becomes one without distortion, of the same size, focal lengths and principal
    point."""
    pinhole = replace(camera, distortion=(0.0,) * 5)
    xy = pinhole.centres(pinhole.frame)
    uv = camera.project(np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], -1))
    with np.errstate(invalid="ignore"):
        covered = ((uv >= 0) & (uv < (camera.width, camera.height))).all(-1)
    return Resampling(pinhole=pinhole, uv=np.where(covered[..., None], uv, 0), covered=covered)


def _flat(picture: Array) -> Array:
    """Return the picture (H, W, ...) with its pixels one after another, (H * W, ...)."""
    return picture.reshape(-1, *picture.shape[2:])
