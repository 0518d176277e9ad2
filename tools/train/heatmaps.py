"""What the network is taught for a crop, and the keypoints and the pose that its heatmaps mean."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float
from spin_usd.reading.picture import heatmaps_of
from spin_usd.scoring.keypoint_pose import pose_from_keypoints
from train.pictures import PosedPicture, crop_of, keypoint_pixels

STRIDE = 4  # pixels of the crop in a pixel of a heatmap, as the network makes them
SIGMA = 2.0  # pixels of a heatmap, as published
SHIFT, ZOOM = 0.1, 0.25  # by which a detector's box is off, of its side, at most
FLOOR = 1e-6  # below it a heatmap has no logarithm
CERTAIN, FEWEST = 0.25, 6  # of the picture's highest peak: keypoints below are left out, as long as the fewest remain


def taught(
    picture: PosedPicture, points: Float, size: int, rng: np.random.Generator | None
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return a crop (size, size) and its heatmaps (K, size / 4, size / 4); with `rng` of a box that is a little off."""
    pixels = keypoint_pixels(picture, points)
    crop = crop_of(pixels)
    if rng is not None:
        across, down, zoom = rng.uniform(-1, 1, 3).tolist()
        crop = crop.moved(SHIFT * across, SHIFT * down, (1 + ZOOM) ** zoom)
    cells = size // STRIDE
    heatmaps = heatmaps_of(crop.to_crop(pixels, size), (size, size), size=(cells, cells), sigma=SIGMA)
    return crop.of_image(picture.image(), size), heatmaps


def peaks(heatmaps: NDArray[np.float32]) -> tuple[Float, Float]:
    """Return where heatmaps (K, C, C) are highest, (K, 2) x and y in their pixels from the corner, and how high (K,):
    the top of the parabola through the logarithms beside the highest pixel, exact for a Gaussian."""
    count, cells, _ = heatmaps.shape
    y, x = np.divmod(heatmaps.reshape(count, -1).argmax(1), cells)
    logs = np.log(np.maximum(np.pad(heatmaps, ((0, 0), (1, 1), (1, 1)), mode="edge"), FLOOR)).astype(np.float64)
    each = np.arange(count)
    middle = logs[each, y + 1, x + 1]
    found = [
        at + 0.5 + _top(logs[each, y + 1 - down, x + 1 - across], middle, logs[each, y + 1 + down, x + 1 + across])
        for at, across, down in ((x, 1, 0), (y, 0, 1))
    ]
    return np.stack(found, axis=1), heatmaps[each, y, x].astype(np.float64)


def _top(before: Float, middle: Float, after: Float) -> Float:
    """Return where the parabola through three values has its top, of a pixel from the middle one."""
    bend = 2 * middle - before - after
    return np.asarray(np.clip(np.divide(after - before, 2 * bend, out=np.zeros_like(bend), where=bend > 0), -0.5, 0.5))


def pose_of(heatmaps: NDArray[np.float32], picture: PosedPicture, points: Float, size: int) -> tuple[Float, Float]:
    """Return q_cam_body (4,) and t_cam_body (3,) of the heatmaps of the picture's crop; where no pose fits, no rotation
    at the distance at which the points are as large as the box."""
    crop = crop_of(keypoint_pixels(picture, points))
    cells, heights = peaks(heatmaps)
    pixels = crop.from_crop(cells * STRIDE, size)
    order = np.argsort(-heights)
    certain = order[: max(FEWEST, int((heights >= CERTAIN * heights.max()).sum()))]
    found = pose_from_keypoints(points[certain], pixels[certain], picture.camera)
    return _of_box(crop.side, crop.x, crop.y, picture, points) if found is None else found


def _of_box(side: int, x: int, y: int, picture: PosedPicture, points: Float) -> tuple[Float, Float]:
    camera = picture.camera
    z = float(np.ptp(points, axis=0).max()) * camera.fx / side
    t = np.array([(x + side / 2 - camera.cx) / camera.fx * z, (y + side / 2 - camera.cy) / camera.fy * z, z])
    return np.array([1.0, 0.0, 0.0, 0.0]), t
