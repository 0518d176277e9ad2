"""The camera whose level, noise and sharpness are those of real pictures."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from spin_usd.realism.intervals import Interval, median_interval
from spin_usd.realism.picture_view import FULL
from spin_usd.scene.sensor import Optics, Sensor

SIGMAS = (0.0, 0.3, 0.5, 0.7, 0.9, 1.15, 1.4, 1.8, 2.4, 3.2)
"""Candidates of psf_sigma, pixels."""
ADC_BITS = 12
LEAST_SHOT = 1e-3  # variance per step of 8 bits: less is not seen among the rounding
SHARPEST = 0.05  # px


@dataclass(frozen=True, kw_only=True)
class CameraFit:
    """A camera's values, in steps of 8 bits of its linear signal, and pixels."""

    noise: float = 0.0
    shot_noise: float = 0.0
    psf_sigma: float | None = None
    """None where too few pictures have clear edges."""
    intervals: dict[str, Interval] = field(default_factory=dict)
    """95 % intervals of the values that were found."""


def fit_camera(noise: ArrayLike, shot_noise: ArrayLike, psf_sigma: ArrayLike) -> CameraFit:
    """Return the camera of pictures (N) with these values, NaN where a picture has none."""
    values: dict[str, float] = {}
    intervals: dict[str, Interval] = {}
    for name, of in (("noise", noise), ("shot_noise", shot_noise), ("psf_sigma", psf_sigma)):
        value, around = median_interval(of)
        if np.isfinite(around).all():
            values[name], intervals[name] = max(value, 0.0), around
    return CameraFit(**values, intervals=intervals)


def sigma_of_spread(spread: float, spreads: ArrayLike) -> float:
    """Return the psf_sigma at which our edges have that spread; `spreads`: of ours with each of SIGMAS. NaN where it
    cannot be found: also beyond the spreads that are known, if those of smaller or larger SIGMAS are not."""
    found, sigmas = np.asarray(spreads, np.float64), np.array(SIGMAS)
    good = np.isfinite(found)
    if not np.isfinite(spread) or good.sum() < 2:
        return float("nan")
    rising = np.maximum.accumulate(found[good])
    if (spread < rising[0] and not good[0]) or (spread > rising[-1] and not good[-1]):
        return float("nan")
    return float(np.interp(spread, rising, sigmas[good]))


def fitted_sensor(sensor: Sensor, fit: CameraFit, level: float) -> Sensor:
    """Return the sensor with the fit's noise and a black level, steps of 8 bits of its linear signal."""
    full = 2**ADC_BITS - 1
    steps = full / FULL  # of the ADC per step of 8 bits
    per_step = 1 / (max(fit.shot_noise, LEAST_SHOT) * steps)
    return replace(
        sensor,
        adc_bits=ADC_BITS,
        gain=per_step * sensor.iso / 100,
        read_noise=fit.noise * steps * per_step,
        black_level=level * steps,
        full_well=0.0,
        dark_current=0.0,
        auto_exposure=None,
    )


def fitted_optics(optics: Optics, fit: CameraFit) -> Optics:
    """Return the optics with the fit's point spread function."""
    if fit.psf_sigma is None:
        return optics
    return replace(optics, psf_sigma=fit.psf_sigma if fit.psf_sigma > SHARPEST else 0.0)
