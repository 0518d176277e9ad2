"""The transfer curve of sRGB.

Source: IEC 61966-2-1:1999.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

LINEAR_KNEE = 0.0031308  # below it the curve is straight
ENCODED_KNEE = 0.04045


def encode(linear: NDArray[Any]) -> NDArray[Any]:
    """Code values of linear ones, both 0 to 1, of any shape; floats keep their precision."""
    curved = 1.055 * np.maximum(linear, LINEAR_KNEE) ** (1 / 2.4) - 0.055
    return np.where(linear <= LINEAR_KNEE, 12.92 * linear, curved)


def decode(encoded: NDArray[Any]) -> NDArray[Any]:
    """Linear values of code values, both 0 to 1, of any shape; floats keep their precision."""
    curved = ((np.maximum(encoded, ENCODED_KNEE) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= ENCODED_KNEE, encoded / 12.92, curved)
