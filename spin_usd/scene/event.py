"""An event of a camera whose pixels report changes of brightness, in the form that all code uses."""

import numpy as np
from numpy.typing import NDArray

EVENT = np.dtype([("t", "<i8"), ("x", "<u2"), ("y", "<u2"), ("p", "?"), ("target", "<u2"), ("part", "<u2")])
"""Microseconds on the stage's clock, column and row, whether it is brighter, and the ids at its pixel, as in the labels
`instance` and `segmentation`: 0 for nothing."""
Events = NDArray[np.void]
"""Events (N,) with the fields of EVENT; without target and part if not requested."""
