"""Photon transfer by the method of EMVA Standard 1288, from image files' numbers alone.

Of a pair of flat fields the temporal variance is half that of their difference, so that fixed patterns cancel. Variance
over mean has slope 1 / gain; without light it is that of the read noise and of the ADC's rounding, a twelfth of a
step squared; the full well is where the mean no longer rises.
"""

from dataclasses import dataclass

import numpy as np

ADC_ROUNDING = 1 / 12


@dataclass(frozen=True, kw_only=True)
class Detector:
    """gain: electrons per ADC step · read_noise, full_well: electrons · bits of the ADC · black_level: ADC steps ·
    prnu: standard deviation of the relative gain."""

    gain: float
    read_noise: float
    full_well: float
    bits: float
    black_level: float
    prnu: float


def characterise(dark, pairs, saturated):
    """The Detector of linear 16-bit images (H, W): a pair without light or time, pairs at rising exposure below
    saturation, and one far above."""
    numbers = np.unique(np.concatenate([image.ravel() for pair in pairs for image in pair]).astype(np.int64))
    bits = np.log2((2**16 - 1) / np.diff(numbers).min() + 1)
    step = (2**16 - 1) / (2 ** round(bits) - 1)
    black, dark_variance = _statistics(dark, step)
    mean, variance = np.array([_statistics(pair, step) for pair in pairs]).T
    gain = 1 / np.polyfit(mean, variance, 1)[0]
    first, second = (image / step for image in pairs[-1])
    pattern = np.cov(first.ravel(), second.ravel())[0, 1]
    return Detector(
        gain=gain,
        read_noise=np.sqrt(dark_variance - ADC_ROUNDING) * gain,
        full_well=((saturated / step).mean() - black) * gain,
        bits=bits,
        black_level=black,
        prnu=np.sqrt(max(pattern, 0)) / (mean[-1] - black),
    )


def _statistics(pair, step):
    first, second = (image / step for image in pair)
    return (first.mean() + second.mean()) / 2, (first - second).var() / 2
