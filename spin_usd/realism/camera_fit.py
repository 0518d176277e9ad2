"""The camera whose level, noise and sharpness are those of real pictures.

JPEG removes some noise and correlates the rest. The fit finds the quality from that correlation, and then the white
noise that leaves the measured noise after compression.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spin_usd.basics.arrays import Float
from spin_usd.realism.darkness import ROUNDING, flat_noise
from spin_usd.realism.intervals import Interval, median_interval
from spin_usd.realism.picture_view import FULL
from spin_usd.scene.sensor import Optics, Sensor
from spin_usd.sensor.detector import compressed, in_the_dark

SIGMAS = (0.0, 0.3, 0.5, 0.7, 0.9, 1.15, 1.4, 1.8, 2.4, 3.2)
"""Candidates of psf_sigma, pixels."""
ADC_BITS = 12
LEAST_SHOT = 1e-3  # variance per step of 8 bits: less is not seen among the rounding
SHARPEST = 0.05  # px
QUALITIES = (95, 90, 85, 80, 75, 70, 60, 50, 40)
CORRELATED = 0.1  # sum of two correlations of neighbours: less is no sign of a JPEG
NOISES = np.geomspace(0.9, 4.0, 16)  # of the noise that is left after a JPEG
LIT_NOISES = np.geomspace(1, 16, 40)  # of the noise in the dark
PATCH = 256  # pixels a side
TINY = 1e-12  # variance
BRIGHT = 100.0  # grey: signal at which shot noise is compared


@dataclass(frozen=True, kw_only=True)
class CameraFit:
    """A camera's values, in steps of 8 bits of its linear signal, and pixels."""

    noise: float | None = None
    """None, as the next two, where too few pictures have it: the camera's own stays."""
    shot_noise: float | None = None
    psf_sigma: float | None = None
    jpeg_quality: int | None = None
    """None where no JPEG was found: the camera's own stays."""
    intervals: dict[str, Interval] = field(default_factory=dict)
    """95 % intervals of the values that were found."""


def fit_camera(noise: ArrayLike, shot_noise: ArrayLike, psf_sigma: ArrayLike) -> CameraFit:
    """Return the camera of pictures (N) with these values, NaN where a picture has none."""
    values: dict[str, Any] = {}
    intervals: dict[str, Interval] = {}
    for name, of in (("noise", noise), ("shot_noise", shot_noise), ("psf_sigma", psf_sigma)):
        value, around = median_interval(of)
        if np.isfinite(around).all():
            values[name], intervals[name] = max(value, 0.0), around
    return CameraFit(**values, intervals=intervals)


def before_jpeg(fit: CameraFit, real: Mapping[str, float]) -> CameraFit:
    """Return the fit of pictures that are JPEGs: the quality, and the noise before the loss. `real`: medians of the
    pictures' measures, which are of their own numbers, where the fit is of the linear signal."""
    level, left, shot = real["black_level"], real["noise"], real["shot_noise"]
    correlation = real["noise_across"] + real["noise_down"]
    if fit.noise is None or not left > 0 or not correlation > CORRELATED:
        return fit
    white, noises = np.random.default_rng(0).standard_normal((PATCH, PATCH)), left * NOISES
    curves = {q: [_noise_in(_compressed(level + noise * white, q)) for noise in noises] for q in QUALITIES}

    def noise_before(quality: int) -> float:
        return float(np.interp(left, np.maximum.accumulate([each for each, _ in curves[quality]]), noises))

    def mismatch(quality: int) -> float:
        correlations = [each for _, each in curves[quality]]
        return abs(float(np.interp(noise_before(quality), noises, correlations)) - correlation)

    place = QUALITIES.index(min(QUALITIES, key=mismatch))
    quality = QUALITIES[place]
    noise = noise_before(quality)
    factors = {"noise": noise / left}
    unit = flat_noise(_compressed(level + noise * white, quality))
    if fit.shot_noise and shot > 0 and unit > 0:
        lit, per_unit = noise * LIT_NOISES, (left**2 + ROUNDING) / unit / BRIGHT
        slopes = [(flat_noise(_compressed(level + BRIGHT + each * white, quality)) - unit) * per_unit for each in lit]
        brighter = float(np.interp(shot, np.maximum.accumulate(slopes), lit))
        factors["shot_noise"] = (brighter**2 - noise**2) / BRIGHT / shot
    intervals = {
        **{n: (low * factors.get(n, 1), high * factors.get(n, 1)) for n, (low, high) in fit.intervals.items()},
        "jpeg_quality": (QUALITIES[min(place + 1, len(QUALITIES) - 1)], QUALITIES[max(place - 1, 0)]),
    }
    values = {name: getattr(fit, name) * factor for name, factor in factors.items()}
    return replace(fit, **values, jpeg_quality=quality, intervals=intervals)


def _compressed(grey: Float, quality: int) -> NDArray[np.float32]:
    """Return a picture (H, W) as it is after a JPEG."""
    image = np.clip(np.rint(grey), 0, FULL).astype(np.uint8)
    return compressed(image[..., None], quality)[..., 0].astype(np.float32)


def _noise_in(flat: NDArray[np.float32]) -> tuple[float, float]:
    """Return the noise of a flat field (H, W), as `darkness` measures it, and the sum of the correlations of neighbours
    in a row and in a column."""
    rest = flat - flat.mean(dtype=np.float64)
    correlation = (rest[:, 1:] * rest[:, :-1]).mean() + (rest[1:] * rest[:-1]).mean()
    noise = np.sqrt(max(float(np.square(np.diff(rest, axis=1)).mean() / 2 - ROUNDING), 0.0))
    return float(noise), float(correlation / max(rest.var(), TINY))


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
    steps = (2**ADC_BITS - 1) / FULL  # of the ADC per step of 8 bits
    own_shot, own_noise = _own_noise(sensor)
    noise = own_noise if fit.noise is None else fit.noise
    per_step = 1 / (max(own_shot if fit.shot_noise is None else fit.shot_noise, LEAST_SHOT) * steps)
    return replace(
        sensor,
        adc_bits=ADC_BITS,
        gain=per_step * sensor.iso / 100,
        read_noise=noise * steps * per_step,
        black_level=level * steps,
        jpeg_quality=sensor.jpeg_quality if fit.jpeg_quality is None else fit.jpeg_quality,
        full_well=0.0,
        dark_current=0.0,
        auto_exposure=None,
    )


def _own_noise(sensor: Sensor) -> tuple[float, float]:
    """Return the shot noise of a sensor, variance per step of its linear signal, and its noise in the dark."""
    if sensor.gain == 0:
        return 0.0, 0.0
    steps = (2**sensor.adc_bits - 1) / FULL
    return sensor.iso / 100 / sensor.gain / steps, FULL * in_the_dark(sensor)[1]


def fitted_optics(optics: Optics, fit: CameraFit) -> Optics:
    """Return the optics with the fit's point spread function."""
    if fit.psf_sigma is None:
        return optics
    return replace(optics, psf_sigma=fit.psf_sigma if fit.psf_sigma > SHARPEST else 0.0)
