"""The pinhole camera with Brown-Conrady distortion: points to pixels and pixels to rays.

Pixel coordinates have (0, 0) at the *corner* of the image; the first pixel's centre is (0.5, 0.5).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.arrays import Float, digest
from spin_usd.errors import GeometryError
from spin_usd.geometry import lens
from spin_usd.geometry.region import Region

MAX_PIXELS_PER_SIDE = 65536  # Blender clamps above this without a word


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Intrinsics: size in pixels, focal lengths and principal point in pixels, distortion k1, k2, p1, p2, k3."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = getattr(self, name)
            if not (isinstance(value, int) and 1 <= value <= MAX_PIXELS_PER_SIDE):
                raise GeometryError(f"camera {name} is {value!r}, expected 1 to {MAX_PIXELS_PER_SIDE} pixels")
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        if len(self.distortion) != 5 or not np.isfinite(numbers).all():
            raise GeometryError(f"camera holds NaN, infinity or not five distortion coefficients: {numbers}")
        if self.fx <= 0 or self.fy <= 0:
            raise GeometryError(f"camera focal length is ({self.fx}, {self.fy}) px, expected above zero")

    @property
    def matrix(self) -> Float:
        """K (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def distorted(self) -> bool:
        return any(self.distortion)

    @property
    def frame(self) -> Region:
        """All of the image's pixels."""
        return Region.full(self.width, self.height)

    @cached_property
    def key(self) -> str:
        return digest([self.width, self.height, self.fx, self.fy, self.cx, self.cy, *self.distortion])

    def project(self, points_cam: ArrayLike) -> Float:
        """Pixels (..., 2) of the points (..., 3) in the camera frame; NaN where z <= 0."""
        p = np.asarray(points_cam, np.float64)
        z = np.where(p[..., 2] > 0, p[..., 2], np.nan)
        return self.pixels(p[..., :2] / z[..., None])

    def pixels(self, xy: ArrayLike) -> Float:
        """Pixels (..., 2) of undistorted normalised coordinates (..., 2)."""
        return lens.distort(xy, self.distortion) * (self.fx, self.fy) + (self.cx, self.cy)

    def normalised(self, uv: ArrayLike) -> Float:
        """Undistorted normalised coordinates (..., 2) of the pixels `uv` (..., 2).

        Raises GeometryError where the lens model cannot be inverted.
        """
        xy = (np.asarray(uv, np.float64) - (self.cx, self.cy)) / (self.fx, self.fy)
        return lens.undistort(xy, self.distortion)

    def rays(self, uv: ArrayLike) -> Float:
        """Directions (..., 3) in the camera frame with z = 1 through the pixels `uv` (..., 2)."""
        xy = self.normalised(uv)
        return np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], -1)

    def centre_rays(self, region: Region) -> Float:
        """Directions (rows, columns, 3), z = 1, through the pixel centres of `region`."""
        u, v = np.meshgrid(np.arange(region.x0, region.x1) + 0.5, np.arange(region.y0, region.y1) + 0.5)
        return self.rays(np.stack([u, v], -1))

    def check_invertible(self) -> None:
        """Raise GeometryError unless every pixel of the frame, its rim included, has a ray."""
        w, h = self.width, self.height
        s = np.linspace(0, 1, 129)
        rim = np.concatenate(
            [np.stack([w * s, 0 * s], 1), np.stack([w * s, 0 * s + h], 1)]
            + [np.stack([0 * s, h * s], 1), np.stack([0 * s + w, h * s], 1)]
        )
        self.normalised(rim)
