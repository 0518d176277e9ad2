"""The detector: light to electrons to steps of the ADC.

Names and symbols follow EMVA Standard 1288, "Standard for Characterization of Image Sensors and Cameras", release 4.0.
A film grain texture, which other simulators add to their pictures, is not detector noise and is left out.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, frozen
from spin_usd.errors import UnsupportedError
from spin_usd.geometry.region import Region
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.tone import mixes_channels, unrounded, written

BAND = 32768  # numbers worked on at once: the temporaries of a formula fit a core's cache
BEYOND = 4.0  # full scales: light above them is cut there, before it becomes infinite electrons ...
BEYOND_ELECTRONS = 1e6  # ... and this many electrons, so that noise never brings a cut-off signal back into range

SHOT, READ, PATTERN = range(3)
FEW = 12.0  # electrons, below which photons are counted by a true Poisson generator

Electrons = NDArray[np.float32]


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


def detect(
    light: NDArray[np.float32], sensor: Sensor, *, seed: int, of: tuple[Region, Region] | None = None
) -> NDArray[Any]:
    """Return the image (H, W), or (H, W, 3) for an rgb sensor, uint8 or uint16, of `light` (H, W, C): W/m2/sr as
    `collect` gives it. Noise is sampled from `seed`; without `gain` there is neither noise nor ADC. `of`: the frame,
    and the region of it that the light falls on; all of it if not given.

    Raises UnsupportedError for a sensor with another bit depth or encoding than there are.
    """
    image = (
        _written_ideally(light, sensor)
        if sensor.gain == 0
        else _written_steps(digitised(light, sensor, seed=seed, of=of), sensor)
    )
    image = compressed(image, sensor.jpeg_quality) if sensor.jpeg_quality else image
    return image[..., 0] if sensor.channels == "mono" else image


def compressed(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Return the image (H, W, C) of 1 or 3 channels, red first, as it is after a JPEG of that quality."""
    import cv2  # not above: it is slow to load

    how = [cv2.IMWRITE_JPEG_QUALITY, quality]
    how += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    _, file = cv2.imencode(".jpg", image[..., ::-1], how)
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_UNCHANGED), np.uint8).reshape(image.shape)[..., ::-1]


def digitised(
    light: NDArray[np.float32], sensor: Sensor, *, seed: int, of: tuple[Region, Region] | None = None
) -> NDArray[np.uint16]:
    """Steps of the ADC (H, W, C) for `light` (H, W, C); `of` as `detect` has it.

    expected electrons  mu_e = signal x (1 + PRNU) x gain x 100 / iso x full scale + dark current x time
    electrons           Poisson(mu_e), at most the full well, plus normal read noise
    ADC steps           electrons / (gain x 100 / iso) + black level, rounded and clipped to adc_bits

    `gain` is EMVA's 1 / K at ISO 100, in electrons per step.
    """
    full_scale = 2**sensor.adc_bits - 1
    per_step = sensor.gain * 100 / sensor.iso
    per_light = np.float32(sensor.exposure * full_scale * per_step)
    most = np.float32(BEYOND * full_scale * per_step + BEYOND_ELECTRONS)
    dark = np.float32(sensor.dark_current * sensor.time)
    shape, region = ((*of[0].shape, light.shape[-1]), of[1]) if of else (light.shape, None)
    gains = pixel_gains(shape, sensor.prnu, sensor.pattern_seed, region) if sensor.prnu else None
    shot, read = stream(seed, SHOT), stream(seed, READ)
    steps = np.empty(light.shape, np.uint16)
    for band in _bands(light.shape):
        expected = light[band] * per_light
        if gains is not None:
            expected *= gains[band]
        electrons = poisson(np.clip(expected + dark, 0, most), shot)
        if sensor.full_well:
            np.minimum(electrons, np.float32(sensor.full_well), out=electrons)
        if sensor.read_noise:
            electrons += np.float32(sensor.read_noise) * read.standard_normal(electrons.shape, np.float32)
        electrons *= np.float32(1 / per_step)
        electrons += np.float32(sensor.black_level)
        steps[band] = np.clip(np.rint(electrons), 0, full_scale)
    return steps


def in_the_dark(sensor: Sensor) -> tuple[float, float]:
    """Mean and standard deviation of the signal, in the unit range, that comes of no light at all."""
    if sensor.gain == 0:
        return 0.0, 0.0
    per_step, full_scale = sensor.gain * 100 / sensor.iso, 2**sensor.adc_bits - 1
    electrons = sensor.dark_current * sensor.time
    noise = float(np.hypot(np.sqrt(electrons), sensor.read_noise))
    return (electrons / per_step + sensor.black_level) / full_scale, noise / per_step / full_scale


def when_full(sensor: Sensor) -> tuple[float, float]:
    """Mean and standard deviation of the signal, in the unit range, beyond which more light changes nothing: full
    wells, or the ADC's highest step if reached first."""
    if sensor.gain == 0 or sensor.full_well == 0:
        return 1.0, 0.0
    per_step, full_scale = sensor.gain * 100 / sensor.iso, 2**sensor.adc_bits - 1
    signal = (sensor.full_well / per_step + sensor.black_level) / full_scale
    return (signal, sensor.read_noise / per_step / full_scale) if signal < 1 else (1.0, 0.0)


def without_noise(light: NDArray[np.float32], sensor: Sensor) -> Float:
    """Numbers (H, W), or (H, W, 3) for an rgb sensor, before any rounding, of `light` (H, W, C): the result of `detect`
    for pixels with exactly the expected electrons of a perfect one. Raises like it."""
    signal = light.astype(np.float64) * sensor.exposure
    if sensor.gain:
        full_scale, per_step = 2**sensor.adc_bits - 1, sensor.gain * 100 / sensor.iso
        electrons = signal * full_scale * per_step + sensor.dark_current * sensor.time
        held = np.minimum(electrons, sensor.full_well or np.inf)
        signal = (held / per_step + sensor.black_level) / full_scale
    image: Float = unrounded(np.clip(signal, 0, 1), sensor)
    return image[..., 0] if sensor.channels == "mono" else image


def _written_ideally(light: NDArray[np.float32], sensor: Sensor) -> NDArray[Any]:
    """Numbers (H, W, C) without noise or ADC. Black stays black: most of a frame is often empty sky."""
    image = np.zeros(light.shape, written(np.zeros((0, light.shape[-1])), sensor).dtype)
    for band in _bands(light.shape):
        lit = light[band].any(-1)
        signal = light[band][lit].astype(np.float64) * sensor.exposure
        image[band][lit] = written(np.clip(signal, 0, 1), sensor)
    return image


def _written_steps(steps: NDArray[np.uint16], sensor: Sensor) -> NDArray[Any]:
    full_scale = 2**sensor.adc_bits - 1
    if mixes_channels(sensor):
        return written(steps / full_scale, sensor)
    table = np.broadcast_to((np.arange(full_scale + 1) / full_scale)[:, None], (full_scale + 1, steps.shape[-1]))
    numbers = written(table, sensor)  # of every step there is: fewer than pixels
    return np.stack([numbers[:, i][steps[..., i]] for i in range(steps.shape[-1])], -1)


def _bands(shape: tuple[int, ...]) -> Iterator[slice]:
    """Slices of whole rows, about BAND numbers each."""
    rows = max(BAND // int(np.prod(shape[1:])), 1)
    return (slice(start, start + rows) for start in range(0, shape[0], rows))


def stream(seed: int, purpose: int) -> np.random.Generator:
    """Random numbers that depend on the picture's `seed` and the purpose alone.

    Every purpose has a stream of its own, so that switching one kind of noise on does not change another.
    """
    return np.random.Generator(np.random.SFC64([seed, purpose]))


def poisson(expected: Electrons, chance: np.random.Generator) -> Electrons:
    """Whole numbers of electrons, Poisson distributed about `expected`, of any shape and at least zero."""
    few = expected < FEW
    if few.all():
        return chance.poisson(expected).astype(np.float32)
    if not few.any():
        return _many(expected, chance)
    found = np.empty_like(expected)
    found[few] = chance.poisson(expected[few])
    found[~few] = _many(expected[~few], chance)
    return found


def _many(expected: Electrons, chance: np.random.Generator) -> Electrons:
    """Poisson by the Cornish-Fisher expansion of its quantiles: from 12 electrons up its mean and variance are exact to
    2e-5, its skewness to 2 %, and it differs from the true distribution by less than 5e-4 in total variation.

    The twelfth is the variance added by rounding a smooth distribution to whole numbers. Source: E. A. Cornish, R. A.
    Fisher, "Moments and cumulants in the specification of distributions" (1938).
    """
    z = chance.standard_normal(expected.shape, np.float32)
    sigma = np.sqrt(expected - np.float32(1 / 12))
    z2 = z * z
    found = (1 - z2) * z
    found /= 72 * sigma
    found += (z2 - 1) / 6
    found += sigma * z
    found += expected
    return np.asarray(np.maximum(np.rint(found, out=found), 0, out=found))


def pixel_gains(shape: tuple[int, ...], prnu: float, seed: int, region: Region | None = None) -> NDArray[np.float32]:
    """Return (H, W, C) relative gain of each pixel, of those in the `region` if given: photo-response non-uniformity
    with standard deviation `prnu`, at least 0. The sensor's own pattern: the same in each of its pictures."""
    pattern = _pattern(shape, seed)
    return np.asarray(np.maximum(1 + np.float32(prnu) * (pattern if region is None else pattern[region.slices]), 0))


@lru_cache(maxsize=2)
def _pattern(shape: tuple[int, ...], seed: int) -> NDArray[np.float32]:
    return frozen(stream(seed, PATTERN).standard_normal(shape, np.float32), np.float32)
