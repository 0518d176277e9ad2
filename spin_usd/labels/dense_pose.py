"""Dense pose: which point of the target each pixel shows."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.derived.surface import Surface


def dense_pose(surface: Surface, shape: tuple[int, int]) -> NDArray[np.float32]:
    """(H, W, 3) float32: X, Y, Z in the target's body frame, metres; 0 where there is no surface."""
    frame = np.zeros((*shape, 3), np.float32)
    frame[surface.rows, surface.columns] = surface.body
    return frame
