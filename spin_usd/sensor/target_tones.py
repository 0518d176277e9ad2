"""Brightness of the target in an image, by its own pixels: most of a picture is empty sky."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.detector import in_the_dark
from spin_usd.sensor.exposure import exposed
from spin_usd.sensor.tone import encode

STOPS = 6  # below full scale: the least light that shows, where the detector adds no noise ...
DEVIATIONS = 3  # ... and where it does, at least so many standard deviations of what it adds in the dark
COVERED = 0.5  # of a pixel: the target's


@dataclass(frozen=True, kw_only=True)
class Tones:
    """Brightness of the target's `pixels` in an image: their `mean`, as a share of the highest number; the shares of
    them that are `dark`, too near to black to show in every channel, and `saturated`, at full scale in every one."""

    pixels: int
    mean: float
    dark: float
    saturated: float


def target_tones(image: NDArray[Any], radiance: Radiance, sensor: Sensor) -> Tones | None:
    """Return the tones of `image`, (H, W) or (H, W, 3), which `sensor` wrote of the target's `radiance`; None where no
    pixel is the target's."""
    covered = radiance.coverage >= COVERED
    if not covered.any():
        return None
    numbers = image[radiance.region.slices][covered].reshape(int(covered.sum()), -1)
    highest = 2**sensor.bit_depth - 1
    return Tones(
        pixels=len(numbers),
        mean=float(numbers.mean(dtype=np.float64)) / highest,
        dark=float((numbers.max(-1) < _least_shown(exposed(sensor, radiance)) * highest).mean()),
        saturated=float((numbers.min(-1) == highest).mean()),
    )


def _least_shown(sensor: Sensor) -> float:
    """Return the number written for the least light that shows, as a share of the highest number."""
    black, noise = in_the_dark(sensor)
    signal = black + max((1 - black) / 2**STOPS, DEVIATIONS * noise)
    return float(encode(np.clip(signal, 0, 1), sensor.encoding, sensor.gamma))
