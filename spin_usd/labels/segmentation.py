"""Segmentation: which part of the target each pixel shows."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.derived.surface import Surface


def segmentation(surface: Surface, shape: tuple[int, int]) -> NDArray[np.uint16]:
    """(H, W) uint16: part ids, which count from 1; 0 where there is no surface."""
    frame = np.zeros(shape, np.uint16)
    frame[surface.rows, surface.columns] = surface.part
    return frame
