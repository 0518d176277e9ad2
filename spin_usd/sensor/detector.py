"""The detector: light of the unit range to the numbers of an image file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.scene.sensor import Sensor

# The sRGB curve: IEC 61966-2-1.
SRGB_KNEE = 0.0031308
DTYPES: dict[int, type[np.uint8] | type[np.uint16]] = {8: np.uint8, 16: np.uint16}


def collect(rgb: NDArray[np.float32], sensor: Sensor) -> NDArray[np.float32]:
    """Light (..., C) that the detector's C channels (mono 1, rgb 3) take in of linear RGB (..., 3); linear in it.

    Raises UnsupportedError for another channel layout.
    """
    weighted = rgb * np.array(sensor.quantum_efficiency, np.float32)
    if sensor.channels == "rgb":
        return weighted
    if sensor.channels != "mono":
        raise UnsupportedError(f"the sensor has the channels {sensor.channels!r}", do="choose mono or rgb")
    return np.asarray(weighted @ np.array(sensor.panchromatic, np.float32)[:, None])


def detect(light: NDArray[np.float32], sensor: Sensor, *, seed: int) -> NDArray[Any]:
    """The image (H, W), or (H, W, 3) for an rgb sensor, uint8 or uint16, of `light` (H, W, C): W/m2/sr as `collect`
    gives it. Noise is drawn from `seed`.

    Raises UnsupportedError for a sensor with another bit depth or encoding than there are.
    """
    if sensor.bit_depth not in DTYPES:
        raise UnsupportedError(f"the sensor has {sensor.bit_depth} bits", do="choose 8 or 16")
    top = 2**sensor.bit_depth - 1
    signal = np.clip(light.astype(np.float64) * sensor.exposure, 0, 1)
    image: NDArray[Any] = np.rint(encode(signal, sensor.encoding) * top).astype(DTYPES[sensor.bit_depth])
    return image[..., 0] if sensor.channels == "mono" else image


def encode(signal: NDArray[Any], encoding: str) -> NDArray[Any]:
    """Linear values of the unit range by the transfer curve `encoding`: "linear" or "srgb"."""
    if encoding == "linear":
        return signal
    if encoding != "srgb":
        raise UnsupportedError(f"the sensor has the encoding {encoding!r}", do="choose linear or srgb")
    return np.where(signal <= SRGB_KNEE, 12.92 * signal, 1.055 * np.maximum(signal, SRGB_KNEE) ** (1 / 2.4) - 0.055)
