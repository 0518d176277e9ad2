"""A camera's pixels as rays and as solid angles."""

from collections.abc import Iterator

import numpy as np

from spin_usd.arrays import Float
from spin_usd.geometry import lens
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.renderers.background.arithmetic.elementary import Float32
from spin_usd.renderers.background.planet.globe import Rays

WIDE = 0.7  # sine of a cone that is not worth bounding


def bands(camera: Camera, region: Region) -> Iterator[tuple[Region, Rays]]:
    """Yield the pixels of `region` in bands that fit a processor's cache, each with the rays (N,) through their
    centres."""
    for band in region.bands():
        yield band, Rays.through(camera, np.moveaxis(camera.centres(band), -1, 0).reshape(2, -1))


def solid_angles(camera: Camera, xy: Float) -> Float:
    """Return the solid angles (N,), sr, of the pixels around the undistorted normalised coordinates (N, 2)."""
    stretch = np.abs(np.linalg.det(lens.distortion_jacobian(xy, camera.distortion)))
    return np.asarray(1 / (camera.fx * camera.fy * stretch * (1 + (xy**2).sum(1)) ** 1.5))


def region_of_cone(camera: Camera, axis: Float, sine: float) -> Region:
    """Return the pixels that can see into the cone around `axis` (3,), unit, whose angular radius has the `sine`."""
    if sine > WIDE:
        return camera.frame
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    turn = np.linspace(0, 2 * np.pi, 65)[:, None]
    rim = np.sqrt(1 - sine**2) * axis + sine * (np.cos(turn) * across + np.sin(turn) * np.cross(axis, across))
    if (rim[:, 2] <= 0).all():
        return Region(x0=0, y0=0, x1=0, y1=0)
    pixels = camera.project(rim)
    if not np.isfinite(pixels).all():
        return camera.frame
    (x0, y0), (x1, y1) = np.floor(pixels.min(0)), np.ceil(pixels.max(0))
    # Between 64 points a circle bulges by a thousandth of its size.
    margin = 2 + int(0.01 * max(x1 - x0, y1 - y0))
    return Region(x0=int(x0), y0=int(y0), x1=int(x1), y1=int(y1)).padded(margin) & camera.frame


def splat(frame: Float32, camera: Camera, directions: Float, irradiance: Float) -> None:
    """Add points at infinity to the radiances `frame` (H, W, 3): directions (N, 3), unit; irradiance (N, 3) W/m2.

    Each lights the four pixels around it, so that its light and its centre are right wherever in a pixel it falls.
    """
    ahead = directions[:, 2] > 0
    xyz, light = directions[ahead], irradiance[ahead]
    field_radius = np.hypot(*camera.normalised(camera.rim(64)).T).max() * 1.02 + 2 / camera.fx
    near = np.hypot(xyz[:, 0], xyz[:, 1]) < field_radius * xyz[:, 2]
    xyz, light = xyz[near], light[near]
    uv = camera.project(xyz)
    seen = np.isfinite(uv).all(1)
    uv, light, xy = uv[seen], light[seen], xyz[seen, :2] / xyz[seen, 2:]
    radiance = light / solid_angles(camera, xy)[:, None]
    corner = np.floor(uv - 0.5)
    share = uv - 0.5 - corner
    for dy in (0, 1):
        for dx in (0, 1):
            weight = np.abs(1 - dx - share[:, 0]) * np.abs(1 - dy - share[:, 1])
            column, row = corner[:, 0] + dx, corner[:, 1] + dy
            inside = (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
            at = row[inside].astype(int), column[inside].astype(int)
            np.add.at(frame, at, (weight[:, None] * radiance)[inside].astype(np.float32))
