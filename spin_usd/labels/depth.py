"""Depth: planar z, metres."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.derived.surface import Surface


def depth(surface: Surface, shape: tuple[int, int]) -> NDArray[np.float32]:
    """(H, W) float32: z in the camera's frame, metres; 0 where there is no surface."""
    frame = np.zeros(shape, np.float32)
    frame[surface.rows, surface.columns] = surface.z
    return frame
