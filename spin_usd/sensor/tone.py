"""Tone: the adjustments of taste and the transfer curve between a detector's numbers and those written."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.errors import UnsupportedError
from spin_usd.scene.derived import srgb
from spin_usd.scene.sensor import LUMINANCE, Sensor

MID_GREY = 0.18  # linear; pivot of contrast
DTYPES: dict[int, type[np.uint8] | type[np.uint16]] = {8: np.uint8, 16: np.uint16}


def written(signal: NDArray[Any], sensor: Sensor) -> NDArray[Any]:
    """uint8 or uint16 of linear `signal` (..., C) in the unit range.

    Raises UnsupportedError for a sensor with another bit depth or encoding than there are.
    """
    numbers: NDArray[Any] = np.rint(unrounded(signal, sensor)).astype(DTYPES[sensor.bit_depth])
    return numbers


def unrounded(signal: NDArray[Any], sensor: Sensor) -> NDArray[Any]:
    """Return the numbers that `written` rounds. Raises as it does."""
    if sensor.bit_depth not in DTYPES:
        raise UnsupportedError(f"the sensor has {sensor.bit_depth} bits", do="choose 8 or 16")
    encoded = encode(adjusted(signal, sensor), sensor.encoding, sensor.gamma)
    return np.asarray(encoded * (2**sensor.bit_depth - 1))


def adjusted(signal: NDArray[Any], sensor: Sensor) -> NDArray[Any]:
    """`signal` (..., C) after contrast, filter and saturation, in this order.

    Contrast is a power about mid-grey, which is a factor on the logarithm of the light; the filter multiplies R, G, B;
    saturation is the distance from the colour's luminance. Of a mono sensor the filter's luminance counts.
    """
    if sensor.contrast != 1:
        signal = MID_GREY * (signal / MID_GREY) ** sensor.contrast
    if sensor.filter != (1, 1, 1):
        colour = np.array(sensor.filter)
        signal = signal * (colour if sensor.channels == "rgb" else colour @ np.array(LUMINANCE))
    if mixes_channels(sensor):
        grey = (signal @ np.array(LUMINANCE))[..., None]
        signal = grey + sensor.saturation * (signal - grey)
    return np.asarray(np.clip(signal, 0, 1))


def mixes_channels(sensor: Sensor) -> bool:
    """Return whether a written number depends on the other channels of its pixel."""
    return sensor.channels == "rgb" and sensor.saturation != 1


def encode(signal: NDArray[Any], encoding: str, gamma: float = 2.2) -> NDArray[Any]:
    """Linear values of the unit range by the transfer curve `encoding`: "linear", "srgb", or "gamma", a power."""
    if encoding == "linear":
        return signal
    if encoding == "gamma":
        return np.asarray(signal ** (1 / gamma))
    if encoding != "srgb":
        raise UnsupportedError(f"the sensor has the encoding {encoding!r}", do="choose linear, srgb or gamma")
    return srgb.encode(signal)
