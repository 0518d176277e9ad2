"""The optics: how lens and housing spread light before the detector counts it."""

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.sensor import Optics


def through_optics(light: NDArray[np.float32], optics: Optics) -> NDArray[np.float32]:
    """`light` (H, W, C) of the whole frame as it falls on the detector."""
    return light
