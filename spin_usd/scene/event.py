"""An event of a camera whose pixels tell changes of brightness, as all who make, write and read them have it."""

import numpy as np
from numpy.typing import NDArray

EVENT = np.dtype([("t", "<i8"), ("x", "<u2"), ("y", "<u2"), ("p", "?"), ("target", "<u2"), ("part", "<u2")])
"""Microseconds on the stage's clock, column and row, whether it is brighter, and the ids of what its pixel showed, as
in the labels `instance` and `segmentation`: 0 for nothing."""
Events = NDArray[np.void]
"""Events (N,) with the fields of EVENT; without target and part where nobody asked for them."""
