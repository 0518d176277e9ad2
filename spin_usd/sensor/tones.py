"""How bright the target is in an image: by its own pixels, for most of a frame is empty sky."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.scene.passes import Radiance
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.tone import encode

STOPS = 5  # below full scale; what is darker drowns in what detectors add of themselves
COVERED = 0.5  # of a pixel: the target's


@dataclass(frozen=True, kw_only=True)
class Tones:
    """Of the target's `pixels` in an image: their `mean`, as a share of the highest number; the share of them that is
    `dark`, more than five stops below full scale in every channel, and that is `saturated`, at full scale in every."""

    pixels: int
    mean: float
    dark: float
    saturated: float


def target_tones(image: NDArray[Any], radiance: Radiance, sensor: Sensor) -> Tones | None:
    """Those of `image`, (H, W) or (H, W, 3), which `sensor` wrote of the target's `radiance`; None where no pixel is
    the target's."""
    covered = radiance.coverage >= COVERED
    if not covered.any():
        return None
    numbers = image[radiance.region.slices][covered].reshape(int(covered.sum()), -1)
    highest = 2**sensor.bit_depth - 1
    return Tones(
        pixels=len(numbers),
        mean=float(numbers.mean(dtype=np.float64)) / highest,
        dark=float((numbers.max(-1) < _darkest_shown(sensor) * highest).mean()),
        saturated=float((numbers.min(-1) == highest).mean()),
    )


def _darkest_shown(sensor: Sensor) -> float:
    """What is written, as a share of the highest number, of light five stops below full scale."""
    black = sensor.black_level / (2**sensor.adc_bits - 1) if sensor.gain else 0.0
    return float(encode(np.array(black + (1 - black) / 2**STOPS), sensor.encoding, sensor.gamma))
