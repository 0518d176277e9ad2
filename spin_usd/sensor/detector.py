"""The detector: linear radiance to the numbers of an image file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.scene.model import Sensor
from spin_usd.scene.passes import Radiance

# Luminance of linear RGB with Rec. 709 primaries: ITU-R BT.709-6, item 3.2.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# The sRGB curve: IEC 61966-2-1.
SRGB_KNEE = 0.0031308
DTYPES: dict[int, type[np.uint8] | type[np.uint16]] = {8: np.uint8, 16: np.uint16}


def expose(radiance: Radiance, sensor: Sensor, shape: tuple[int, int]) -> NDArray[Any]:
    """The image (H, W), or (H, W, 3) for an rgb sensor; uint8 or uint16; black outside the radiance's region.

    Raises UnsupportedError for a sensor with another channel layout, bit depth or encoding than there are.
    """
    if sensor.bit_depth not in DTYPES:
        raise UnsupportedError(f"the sensor has {sensor.bit_depth} bits", do="choose 8 or 16")
    top = 2**sensor.bit_depth - 1
    signal = np.clip(_channels(radiance.rgb, sensor.channels) * sensor.exposure, 0, 1)
    image = np.zeros((*shape, *signal.shape[2:]), DTYPES[sensor.bit_depth])
    image[radiance.region.slices] = np.rint(encode(signal, sensor.encoding) * top)
    return image


def encode(signal: NDArray[Any], encoding: str) -> NDArray[Any]:
    """Linear values of the unit range by the transfer curve `encoding`: "linear" or "srgb"."""
    if encoding == "linear":
        return signal
    if encoding != "srgb":
        raise UnsupportedError(f"the sensor has the encoding {encoding!r}", do="choose linear or srgb")
    return np.where(signal <= SRGB_KNEE, 12.92 * signal, 1.055 * np.maximum(signal, SRGB_KNEE) ** (1 / 2.4) - 0.055)


def _channels(rgb: NDArray[np.float32], channels: str) -> NDArray[Any]:
    if channels == "rgb":
        return rgb.astype(np.float64)
    if channels != "mono":
        raise UnsupportedError(f"the sensor has the channels {channels!r}", do="choose mono or rgb")
    return np.asarray(rgb @ LUMINANCE)
