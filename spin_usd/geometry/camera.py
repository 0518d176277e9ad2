"""The camera, a pinhole with Brown-Conrady distortion or a fisheye: points to pixels and pixels to rays.

Pixel coordinates have (0, 0) at the *corner* of the image; the first pixel's centre is (0.5, 0.5).
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spin_usd.basics.arrays import Float, digest, frozen
from spin_usd.errors import GeometryError
from spin_usd.geometry import lens
from spin_usd.geometry.fisheye import Fisheye
from spin_usd.geometry.region import Region

MAX_PIXELS_PER_SIDE = 65536  # Blender silently clamps above this
RIM_STEPS = 128  # pixels per side of the frame that are tried
SMALLEST, LARGEST = 1e-30, 1e9  # numbers of a lens: powers of others overflow, and no calibration has them
MAX_GRID_PIXELS = 2**23  # cameras up to this keep their pixel centres' inverse, 16 bytes a pixel, for the next frames


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Intrinsics: size in pixels, focal lengths and principal point in pixels, distortion k1, k2, p1, p2, k3, or a
    `Fisheye`."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = getattr(self, name)
            if not (isinstance(value, int) and 1 <= value <= MAX_PIXELS_PER_SIDE):
                raise GeometryError(f"camera {name} is {value!r}, expected 1 to {MAX_PIXELS_PER_SIDE} pixels")
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        if len(self.distortion) != (4 if self.fisheye else 5) or not np.isfinite(numbers).all():
            raise GeometryError(f"camera holds NaN, infinity or not five distortion coefficients: {numbers}")
        if self.fx <= 0 or self.fy <= 0:
            raise GeometryError(f"camera focal length is ({self.fx}, {self.fy}) px, expected above zero")
        for number in numbers:
            if number and not SMALLEST <= abs(number) <= LARGEST:
                raise GeometryError(f"camera holds {number}, expected 0, or {SMALLEST:g} to {LARGEST:g} in magnitude")
        for name in ("fx", "fy", "cx", "cy"):  # 3000 and 3000.0 are one camera and have one key
            object.__setattr__(self, name, float(getattr(self, name)))
        numbers = tuple(float(k) for k in self.distortion)
        object.__setattr__(self, "distortion", Fisheye(*numbers) if self.fisheye else numbers)

    @property
    def matrix(self) -> Float:
        """K (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def looks_past_frame(self) -> bool:
        """True where the principal point lies outside the image, mostly because the calibration is of another size."""
        return not (0 <= self.cx <= self.width and 0 <= self.cy <= self.height)

    @property
    def fisheye(self) -> bool:
        return isinstance(self.distortion, Fisheye)

    @property
    def distorted(self) -> bool:
        return any(self.distortion) or self.fisheye

    @property
    def pinhole(self) -> "Camera":
        """The same camera without distortion."""
        return replace(self, distortion=(0.0,) * 5)

    @property
    def frame(self) -> Region:
        """All of the image's pixels."""
        return Region.full(self.width, self.height)

    @cached_property
    def key(self) -> str:
        return digest([self.width, self.height, self.fx, self.fy, self.cx, self.cy, *self.distortion])

    def project(self, points_cam: ArrayLike) -> Float:
        """Pixels (..., 2) of the points (..., 3) in the camera frame.

        NaN if no pixel sees the point: behind the camera, or so far aside that the lens model folds back.
        """
        p = np.asarray(points_cam, np.float64)
        xy = p[..., :2] / np.where(p[..., 2] > 0, p[..., 2], np.nan)[..., None]
        beyond = np.hypot(xy[..., 0], xy[..., 1]) >= lens.invertible_radius(self.distortion)
        return self.pixels(np.where(beyond[..., None], np.nan, xy))

    def pixels(self, xy: ArrayLike) -> Float:
        """Pixels (..., 2) of undistorted normalised coordinates (..., 2)."""
        found = lens.distort(xy, self.distortion)
        found[..., 0] = found[..., 0] * self.fx + self.cx
        found[..., 1] = found[..., 1] * self.fy + self.cy
        return found

    def normalised(self, uv: ArrayLike) -> Float:
        """Undistorted normalised coordinates (..., 2) of the pixels `uv` (..., 2).

        Raises GeometryError where the lens model cannot be inverted.
        """
        return lens.undistort(self._distorted(uv), self.distortion)

    def normalised_where_seen(self, uv: ArrayLike) -> tuple[Float, NDArray[np.bool_]]:
        """Undistorted normalised coordinates (N, 2) of the pixels `uv` (N, 2), which may lie outside the frame, and
        (N,) whether the lens has any for them."""
        xy = self._distorted(uv)
        rim = lens.image_radius(self.distortion)
        there = np.hypot(xy[:, 0], xy[:, 1]) < rim
        found = np.zeros_like(xy)
        found[there], there[there] = lens.inverse(xy[there], self.distortion)
        return found, there

    def rays(self, uv: ArrayLike) -> Float:
        """Directions (..., 3) in the camera frame with z = 1 through the pixels `uv` (..., 2)."""
        xy = self.normalised(uv)
        return np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], -1)

    def centres(self, region: Region) -> Float:
        """Undistorted normalised coordinates (rows, columns, 2) of the pixel centres of `region`; read-only.

        The inverse of a whole frame is kept, so that the next pictures of a camera cost no Newton steps.
        """
        if not self.distorted or self.width * self.height > MAX_GRID_PIXELS or region & self.frame != region:
            return np.moveaxis(_centres(self, region), 0, -1)
        return np.moveaxis(_frame_centres(self)[:, *region.slices], 0, -1)

    def blind(self, region: Region) -> NDArray[np.bool_] | None:
        """Return (rows, columns) which pixels of `region` lie beyond a right angle from a fisheye's axis; None where no
        pixel of the frame does."""
        rim = lens.image_radius(self.distortion) if self.fisheye else np.inf
        if np.hypot(*self._distorted(self.rim(1)).T).max() < rim:
            return None
        u, v = np.meshgrid(np.arange(region.x0, region.x1) + 0.5, np.arange(region.y0, region.y1) + 0.5)
        return np.asarray(np.hypot((u - self.cx) / self.fx, (v - self.cy) / self.fy) >= rim)

    def check_invertible(self) -> None:
        """Raise GeometryError unless every pixel of the frame, its rim included, has a ray, or is `blind`.

        The lens is one to one where it can be inverted: if the rim is there, so is all that the rim encloses.
        """
        rim = self.rim(RIM_STEPS)
        there = lens.inverse(self._distorted(rim), self.distortion)[1]
        if not there.all() and not lens.sees_right_angle(self.distortion):
            raise self._folded(rim[~there])

    def _distorted(self, uv: ArrayLike) -> Float:
        """Distorted normalised coordinates (..., 2) of the pixels `uv` (..., 2)."""
        xy: Float = (np.asarray(uv, np.float64) - (self.cx, self.cy)) / (self.fx, self.fy)
        return xy

    def _folded(self, uv: Float) -> GeometryError:
        """Return the error for the pixels `uv` (N, 2), which have no ray, with the end of the lens on the way to the
        furthest."""
        radius = np.linalg.norm(uv - (self.cx, self.cy), axis=1)
        worst = int(np.argmax(radius))
        towards = self._distorted(uv[worst])
        fold = lens.invertible_radius(self.distortion) * towards / np.linalg.norm(towards)
        end = float(np.linalg.norm(self.pixels(fold) - (self.cx, self.cy)))
        return GeometryError(
            f"the lens distortion {list(self.distortion)} cannot be inverted at pixel ({uv[worst, 0]:g}, "
            f"{uv[worst, 1]:g}): that way the image folds back {end:.4g} px from the principal point, "
            f"and the frame reaches {radius[worst]:.4g} px",
            do=lens.MONOTONE,
        )

    def rim(self, steps: int) -> Float:
        """Pixel coordinates (4 * steps, 2) around the edge of the image, its corners included."""
        s = np.linspace(0, 1, steps, endpoint=False)[:, None]
        corners = np.array([[0, 0], [self.width, 0], [self.width, self.height], [0, self.height]], np.float64)
        sides = [start + s * (end - start) for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
        return np.concatenate(sides)


@lru_cache(maxsize=2)
def _frame_centres(camera: Camera) -> Float:
    return frozen(_centres(camera, camera.frame))


def _centres(camera: Camera, region: Region) -> Float:
    """x and y (2, rows, columns): apart, because arithmetic on one of them alone is then contiguous."""
    found = np.empty((2, *region.shape))
    for band in region.bands():
        u, v = np.meshgrid(np.arange(band.x0, band.x1) + 0.5, np.arange(band.y0, band.y1) + 0.5)
        xy = camera.normalised(np.stack([u, v], -1))
        found[:, band.y0 - region.y0 : band.y1 - region.y0] = np.moveaxis(xy, -1, 0)
    return found
