"""Pictures drawn without any renderer, of which black level, noise, edges and light are known."""

import cv2
import numpy as np

from spin_usd.realism.picture_view import PictureView

FINE = 16  # points a side by which a pixel's share of a polygon is counted


def polygons(seed: int, count: int, size: tuple[int, int]) -> np.ndarray:
    """(H, W) float64: the share of each pixel that lies in triangles at random places, 0 to 1."""
    rng, (height, width) = np.random.default_rng(seed), size
    fine = np.zeros((height * FINE, width * FINE), np.uint8)
    cell = int(np.ceil(count**0.5))
    for place in range(count):
        row, column = divmod(place, cell)
        centre = (np.array([column, row]) + 0.5) * np.array([width, height]) / cell
        angles = rng.uniform(0, 2 * np.pi) + np.array([0, 2, 4]) * np.pi / 3
        corners = centre + 0.42 * min(width, height) / cell * np.stack([np.cos(angles), np.sin(angles)], -1)
        cv2.fillPoly(fine, [np.rint(corners * FINE).astype(np.int32)], 1)
    return fine.reshape(height, FINE, width, FINE).mean((1, 3))


def written(signal: np.ndarray, *, level: float, noise: float | np.ndarray, seed: int) -> np.ndarray:
    """(H, W) float32: whole steps of 8 bits of a signal above a black level, in noise."""
    chance = np.random.default_rng(seed).standard_normal(signal.shape)
    return np.clip(np.rint(level + signal + noise * chance), 0, 255).astype(np.float32)


def ellipse(size: tuple[int, int], share: float = 0.35) -> np.ndarray:
    """(H, W) bool: an ellipse in the middle, with semi-axes of that share of the sides."""
    y, x = ((np.arange(side) + 0.5) / side - 0.5 for side in size)
    return np.hypot(y[:, None], x[None]) < share


def view(grey: np.ndarray, target: np.ndarray) -> PictureView:
    """A picture whose target is one part."""
    return PictureView(grey=np.asarray(grey, np.float32), parts=target.astype(np.int32))
