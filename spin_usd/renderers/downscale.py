"""A render of fewer pixels than the picture's, each representing a square of them, and the way back.

The pixel (0, 0) is a corner, so the camera of `by` times fewer pixels a side is the same one with its intrinsics
divided by `by`, to the last ray. Where `by` does not divide the frame, the last squares reach beyond it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.camera import Camera
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene, Shutter

MIN_PX = 4  # a side: Blender renders no smaller image


def reduced(scene: Scene, by: int) -> Scene:
    """Return the scene as a camera of `by` times fewer pixels a side sees it."""
    if by == 1:
        return scene
    camera, shutter = _reduced_camera(scene.camera, by), scene.shutter
    if shutter:
        shutter = _reduced_shutter(shutter, by, rows=scene.camera.height, reduced_rows=camera.height)
    return replace(scene, camera=camera, shutter=shutter)


def enlarged(small: Radiance, scene: Scene, by: int) -> Radiance:
    """Return the radiance of `scene.picture_region` from that of `reduced(scene, by)`.

    Light and coverage alike are interpolated linearly between the centres of the squares, and held towards the frame's
    edges. What a square would give to pixels outside the region, where the target is not, its pixels inside get: so the
    light and the area of a target stay what they are, however small it is.
    """
    region, camera = scene.picture_region, scene.camera
    if by == 1 or region.empty or small.region.empty:
        return small if by == 1 else Radiance.dark(region, groups=len(small.groups))
    least = _reduced_camera(camera, by)
    down = _Axis(by, camera.height, least.height, (region.y0, region.y1), (small.region.y0, small.region.y1))
    across = _Axis(by, camera.width, least.width, (region.x0, region.x1), (small.region.x0, small.region.x1))
    planes = np.concatenate([np.moveaxis(small.groups, -1, 1).reshape(-1, *small.region.shape), small.coverage[None]])
    grown = np.stack([across.enlarged(down.enlarged(plane).T).T for plane in planes]).astype(np.float32)
    groups = np.moveaxis(grown[:-1].reshape(len(small.groups), 3, *region.shape), 1, -1)
    return Radiance(region=region, groups=groups, coverage=np.minimum(grown[-1], 1))


def _reduced_camera(camera: Camera, by: int) -> Camera:
    sizes = {name: max(-(-getattr(camera, name) // by), MIN_PX) for name in ("width", "height")}
    return replace(camera, **sizes, **{name: getattr(camera, name) / by for name in ("fx", "fy", "cx", "cy")})


def _reduced_shutter(shutter: Shutter, by: int, *, rows: int, reduced_rows: int) -> Shutter:
    """Return the shutter by which each row is exposed when the middle one is of those that it stands for."""
    first, step = (by - 1) / 2 / max(rows - 1, 1), by / max(rows - 1, 1)
    return replace(shutter, first_row=first, last_row=first + step * (reduced_rows - 1))


@dataclass(frozen=True)
class _Axis:
    """Rows, or columns: of `frame` pixels those in `region` are made of the reduced ones in `small` of a frame of
    `small_frame`."""

    by: int
    frame: int
    small_frame: int
    region: tuple[int, int]
    small: tuple[int, int]

    def enlarged(self, plane: NDArray[np.floating]) -> Float:
        """Return (pixels of the region, N) from the reduced (pixels of `small`, N)."""
        first, second, share = self._between(np.arange(*self.region))
        held = np.zeros((len(plane) + 2, plane.shape[1]))  # beyond its own pixels there is nothing
        held[1:-1] = plane * self._inward()[:, None]
        grown: Float = held[first] * (1 - share)[:, None] + held[second] * share[:, None]
        return grown

    def _between(self, pixels: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], Float]:
        """Return the reduced pixels between whose centres those of `pixels` (N,) lie, counted from one before `small`,
        and how far on the way from the first to the second, 0 to 1."""
        place = np.clip((pixels + 0.5) / self.by, 0.5, self.small_frame - 0.5) - 0.5 - self.small[0]
        first = np.floor(place).astype(np.int64)
        last = self.small[1] - self.small[0] + 1
        return np.clip(first + 1, 0, last), np.clip(first + 2, 0, last), place - first

    def _inward(self) -> Float:
        """Return (reduced pixels,) what each gives to the frame's pixels, over what it gives to those in the region."""
        start, end = self.by * (self.small[0] - 1), self.by * (self.small[1] + 1)
        pixels = np.arange(max(start, 0), min(end, self.frame))
        first, second, share = self._between(pixels)
        within = (self.region[0] <= pixels) & (pixels < self.region[1])
        count = self.small[1] - self.small[0] + 2
        gives, keeps = (
            np.bincount(first, (1 - share) * of, count) + np.bincount(second, share * of, count)
            for of in (np.ones(len(pixels)), within)
        )
        return np.divide(gives, keeps, out=np.zeros(count), where=keeps > 0)[1:-1]
