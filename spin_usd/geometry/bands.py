"""A region of interest cut into bands of rows, each only as wide as the body is there."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spin_usd.basics.arrays import Float
from spin_usd.geometry.bounds import PADDING_PX
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region

ROWS = 8  # height of a slice: bands begin and end at multiples of it
FAR_FRAMES = 8  # frames: a point further out would make edges of very many pieces
PIECE_PX = 4.0  # edges are followed in pieces of about this length; distortion bows none by 1e-3 px


def tight_bands(
    camera: Camera,
    points_cam: ArrayLike,
    edges: NDArray[np.integer],
    region: Region,
    *,
    band_cost_px: float,
    blur_px: float = 0.0,
) -> list[Region]:
    """Boxes that together hold every pixel of `region` that a mesh can touch, chosen so that their pixels and
    `band_cost_px` for each of them are fewest.

    points_cam (P, 3) metres and edges (E, 2) are the mesh's, in the camera frame; every point may be blurred by
    `blur_px`. Within a slice of rows a triangle extends as far as its edges. The region itself where it is so small
    that no cut can pay, or where a point lies behind the camera or far outside the frame.
    """
    if region.empty:
        return []
    # A fisheye bows edges too much; and in a small region a second band would cost more than it could save.
    if camera.fisheye or region.width * region.height <= band_cost_px:
        return [region]
    p = np.asarray(points_cam, np.float64)
    uv = camera.project(p)
    if not np.abs(uv).max() < FAR_FRAMES * max(camera.width, camera.height):  # NaN is not less
        return [region]
    start, end = _pieces(camera, p[:, :2] / p[:, 2:], uv, edges)
    low, high = _extents(start, end, region, PADDING_PX + blur_px)
    bands = [
        Region(
            x0=int(low[a:b].min()),
            x1=int(high[a:b].max()),
            y0=region.y0 + a * ROWS,
            y1=min(region.y0 + b * ROWS, region.y1),
        )
        for a, b in _cheapest_cuts(low, high, band_cost_px)
    ]
    return [band for band in bands if not band.empty]


def _extents(start: Float, end: Float, region: Region, padding: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and end column (S,) of what the segments start to end (2, N), made `padding` pixels wider all round, touch
    in each slice of rows; an empty slice has first > end."""
    count = -(-region.height // ROWS)
    low, high = np.full(count, region.x1), np.full(count, region.x0)
    (left, above), (right, below) = np.minimum(start, end) - padding, np.maximum(start, end) + padding
    left, above = np.floor(left).astype(np.int64), np.floor(above).astype(np.int64) - region.y0
    right, below = np.ceil(right).astype(np.int64), np.ceil(below).astype(np.int64) - region.y0
    first, last = above // ROWS, below // ROWS
    for step in range(int((last - first).max(initial=-1)) + 1):
        row = first + step
        here = (row <= last) & (row >= 0) & (row < count)
        np.minimum.at(low, row[here], left[here])
        np.maximum.at(high, row[here], right[here])
    return np.clip(low, region.x0, region.x1), np.clip(high, region.x0, region.x1)


def _pieces(camera: Camera, xy: Float, uv: Float, edges: NDArray[np.integer]) -> tuple[Float, Float]:
    """Starts and ends (2, N), pixels, of pieces of the edges. An edge is straight in the undistorted coordinates `xy`
    (P, 2), and bowed in the pixels `uv` (P, 2). x and y apart: numpy is slow along an axis of two."""
    i, j = np.ascontiguousarray(edges.T)
    pixels = np.ascontiguousarray(uv.T)
    start, end = pixels.take(i, 1), pixels.take(j, 1)
    count = np.ceil(np.maximum(*np.abs(end - start)) / PIECE_PX)
    long = count > 1
    if not long.any():
        return start, end
    short, count = ~long, count[long].astype(np.int64)
    a, b = np.ascontiguousarray(xy.T).take(i[long], 1), np.ascontiguousarray(xy.T).take(j[long], 1)
    edge = np.repeat(np.arange(len(count)), count)
    k = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    a, step = a.take(edge, 1), ((b - a) / count).take(edge, 1)
    starts, ends = camera.pixels((a + k * step).T).T, camera.pixels((a + (k + 1) * step).T).T
    return np.concatenate([start[:, short], starts], 1), np.concatenate([end[:, short], ends], 1)


def _cheapest_cuts(low: NDArray[np.int64], high: NDArray[np.int64], band_cost_px: float) -> list[tuple[int, int]]:
    """Return the cuts of the slices into bands (first slice, end slice) of least cost, by dynamic programming."""
    count = len(low)
    cost, cut = [0.0] + [np.inf] * count, [0] * (count + 1)
    for end in range(1, count + 1):
        # Widths of the bands that end here, by their beginnings.
        wide = np.maximum.accumulate(high[end - 1 :: -1][:end]) - np.minimum.accumulate(low[end - 1 :: -1][:end])
        for begin in range(end - 1, -1, -1):
            width = max(int(wide[end - 1 - begin]), 0)
            total = cost[begin] + (width * (end - begin) * ROWS + band_cost_px if width else 0)
            if total < cost[end]:
                cost[end], cut[end] = total, begin
    ends = [count]
    while ends[-1]:
        ends.append(cut[ends[-1]])
    return list(pairwise(reversed(ends)))
