"""Pictures of pictures, for people: labels in colours, and sheets of them.

Every image here is (H, W, 3) uint8 RGB.
"""

import colorsys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

RGB = NDArray[np.uint8]

GOLDEN = (5**0.5 - 1) / 2  # steps of this around the colour circle keep any number of hues apart
GUTTER_PX = 6
GUTTER_GREY = 48
CLOUD_PX = 480, 300  # width and height of the image of a LiDAR's points
NEAREST, FARTHEST = 0.95, 0.15  # of the colour map: its dark end stays clear of the black background


def image(numbers: NDArray[Any]) -> RGB:
    """Return a grey (H, W) or RGB (H, W, 3) picture of 8 or 16 bits."""
    eight = np.asarray(numbers >> 8 if numbers.dtype == np.uint16 else numbers, np.uint8)
    return np.repeat(eight[..., None], 3, -1) if eight.ndim == 2 else eight


def by_distance(metres: NDArray[np.float32]) -> RGB:
    """Distances (H, W) in the colour map "viridis": yellow is the target's nearest point, dark blue its farthest."""
    seen = metres > 0
    colours = np.zeros((*metres.shape, 3), np.uint8)
    if seen.any():
        colours[seen] = _distance_colours(metres[seen])
    return colours


def _distance_colours(metres: NDArray[np.float32]) -> RGB:
    """Return the colours (N, 3) of N distances, one at least."""
    import cv2  # not above: cv2 is slow to load, and few need it

    z = metres.astype(np.float64)
    away = (z - z.min()) / max(float(np.ptp(z)), np.finfo(np.float64).tiny)
    level = np.rint(255 * (NEAREST + (FARTHEST - NEAREST) * away)).astype(np.uint8)
    return np.asarray(cv2.applyColorMap(level[:, None], cv2.COLORMAP_VIRIDIS)[:, 0, ::-1])


def as_the_lidar_sees(cloud: NDArray[np.void]) -> RGB:
    """A LiDAR's points as it sees them, azimuth to the left and elevation upwards, by their measured ranges as
    `by_distance`: all that it measured fills the image."""
    wide, tall = CLOUD_PX
    colours = np.zeros((tall, wide, 3), np.uint8)
    if len(cloud):
        x, y, z = cloud["points"].T.astype(np.float64)
        across, down = -np.arctan2(y, x), -np.arctan2(z, np.hypot(x, y))
        scale = 0.9 / max(np.ptp(across) / wide, np.ptp(down) / tall, 1e-9)
        columns = np.rint((across - (across.min() + across.max()) / 2) * scale + (wide - 1) / 2).astype(np.intp)
        rows = np.rint((down - (down.min() + down.max()) / 2) * scale + (tall - 1) / 2).astype(np.intp)
        nearest_last = np.argsort(-cloud["ranges"], kind="stable")
        dots = _distance_colours(cloud["ranges"])[nearest_last]
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            colours[np.minimum(rows + i, tall - 1)[nearest_last], np.minimum(columns + j, wide - 1)[nearest_last]] = (
                dots
            )
    return colours


def by_id(ids: NDArray[np.uint16]) -> RGB:
    """Ids (H, W): each has its own colour, the same in every picture; 0 is black."""
    return np.array([part_colour(i) for i in range(int(ids.max(initial=0)) + 1)], np.uint8)[ids]


def part_colour(part: int) -> tuple[int, int, int]:
    """Return the colour of a part id: neighbouring ids differ in hue, saturation and brightness."""
    if part == 0:
        return 0, 0, 0
    red, green, blue = colorsys.hsv_to_rgb(part * GOLDEN % 1, (0.45, 0.85, 0.65)[part % 3], (1.0, 0.75)[part % 2])
    return round(255 * red), round(255 * green), round(255 * blue)


def by_position(metres: NDArray[np.float32]) -> RGB:
    """Coordinates (H, W, 3): X, Y, Z as red, green, blue, each from the least to the greatest that is visible."""
    seen = (metres[..., 0] != 0) | (metres[..., 1] != 0) | (metres[..., 2] != 0)  # several times as fast as any(-1)
    colours = np.zeros(metres.shape, np.uint8)
    if seen.any():
        for axis in range(3):
            along = metres[..., axis][seen].astype(np.float64)
            size = max(float(np.ptp(along)), np.finfo(np.float64).tiny)
            colours[..., axis][seen] = np.rint(30 + 225 * (along - along.min()) / size)
    return colours


def by_bit(bits: NDArray[np.uint16]) -> RGB:
    """Sets of ids (H, W), bit i - 1 for id i: each pixel has the colour of its least id; none is black."""
    lowest = (bits & -bits.astype(np.int32)).astype(np.float64)
    return by_id(np.where(bits > 0, np.log2(np.maximum(lowest, 1)) + 1, 0).astype(np.uint16))


def by_direction(directions: NDArray[np.float32]) -> RGB:
    """Unit vectors (H, W, 3): X, Y, Z from -1 to 1 as red, green, blue; 0, 0, 0 is black."""
    colours = np.rint(127.5 + 127.5 * directions).astype(np.uint8)
    colours[~directions.any(-1)] = 0
    return colours


def by_motion(flow: NDArray[np.float32]) -> RGB:
    """Flow (H, W, 3), pixels, and the point's state: its direction as the hue, its length, of the longest, as the
    saturation; 0 in the third channel is black."""
    import cv2  # not above: cv2 is slow to load, and few need it

    known = flow[..., 2] > 0
    length = np.hypot(flow[..., 0], flow[..., 1])
    turn = np.arctan2(flow[..., 1], flow[..., 0]) / (2 * np.pi) % 1
    share = length / max(float(length[known].max(initial=0)), np.finfo(np.float32).tiny)
    hsv = np.stack([360 * turn, share, np.ones_like(turn)], -1).astype(np.float32)
    colours = np.rint(255 * cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)).astype(np.uint8)
    colours[~known] = 0
    return colours


def contact_sheet(rows: Sequence[Sequence[RGB]], *, width: int = 480) -> RGB:
    """Rows of images, each reduced to `width` pixels by area averaging, with thin gutters between."""
    if not rows:
        return np.zeros((0, 0, 3), np.uint8)
    tiles = [[reduced(tile, width) for tile in row] for row in rows]
    tall, wide = (max(tile.shape[axis] for row in tiles for tile in row) for axis in (0, 1))
    columns = max(len(row) for row in tiles)
    sheet = np.full((_spaced(tall, len(tiles)), _spaced(wide, columns), 3), GUTTER_GREY, np.uint8)
    for i, row in enumerate(tiles):
        for j, tile in enumerate(row):
            y, x = GUTTER_PX + i * (tall + GUTTER_PX), GUTTER_PX + j * (wide + GUTTER_PX)
            sheet[y : y + tile.shape[0], x : x + tile.shape[1]] = tile
    return sheet


def reduced(picture: RGB, width: int) -> RGB:
    """Return the picture `width` pixels wide by area averaging; a narrower one is unchanged."""
    import cv2  # not above: cv2 is slow to load, and few need it

    tall, wide, _ = picture.shape
    if wide <= width:
        return picture
    return np.asarray(cv2.resize(picture, (width, max(round(tall * width / wide), 1)), interpolation=cv2.INTER_AREA))


def _spaced(size: int, count: int) -> int:
    return GUTTER_PX + count * (size + GUTTER_PX)
