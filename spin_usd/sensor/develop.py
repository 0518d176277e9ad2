"""Development of radiance into the image: the background is added, then come optics and detector."""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float, frozen
from spin_usd.geometry.camera import Camera
from spin_usd.geometry.region import Region
from spin_usd.scene.derived.vignetting import polynomial_gain
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import Optics, Sensor
from spin_usd.sensor.detector import collect, detect, without_noise
from spin_usd.sensor.exposure import exposed

STEP = float(np.log(2))  # of log(s)
NARROWEST, WIDEST = 1e-5, 1e-9  # shares of the energy at the ends that are left to the others
LARGEST = 4.0  # frame diagonals, beyond which a Gaussian leaves less than 1 % of its energy in the frame
KNEE = 0.5  # of the threshold: half the width of its soft onset
FIRST_VARIANCE = 11.4  # pixels squared: a Gaussian of nine taps at half the resolution
SCATTER = (0.05, 0.95)  # meaning of the ends of the setting's range 0 to 1
TINY = 1e-30  # prevents a division by zero
SMALLEST = 4  # pixels of the longer side at the last resolution

Image = NDArray[np.float32]
"""(H, W), or (H, W, 3)."""
Scale = tuple[float, float]
"""A Gaussian's variance along each axis, pixels squared, and its weight."""

DIRECT = 10.0  # variance that is convolved at the resolution at hand; what is left to the next is then at least 2,
# for which the resolution at hand is fine enough
HALVING = 2.0  # variance of a halving and its doubling: 1 each
PAD = 8  # dark pixels around the frame before a halving: more than the radius of its kernels
EXACT = 2.0  # variance from which samples of a Gaussian have its variance, to 1e-15
KERNEL_SIGMAS = 6.0  # standard deviations to which a kernel extends
NEGLIGIBLE = 1e-8  # of a kernel's middle


def develop(
    scene: Scene,
    radiance: Radiance,
    sky: NDArray[np.float32] | None,
    *,
    seed: int,
    region: Region | None = None,
) -> NDArray[Any]:
    """Return the image of `scene`: (H, W) or (H, W, 3), uint8 or uint16; of its `region` alone if given.

    `sky` (H, W, 3): linear radiance of the background, of the region if given; None for black. A region has the
    detector's gains there, its own noise and JPEG blocks, and no light scattered into it from outside.
    """
    sensor = exposed(scene.sensor, radiance)
    region = region or scene.camera.frame
    return detect(_collected(scene, sensor, radiance, sky, region), sensor, seed=seed, of=(scene.camera.frame, region))


def developed_without_noise(scene: Scene, radiance: Radiance, sky: NDArray[np.float32] | None) -> Float:
    """Return the image that `develop` makes, but without the detector's noise and before any rounding: (H, W) or (H, W,
    3), digital numbers."""
    sensor = exposed(scene.sensor, radiance)
    return without_noise(_collected(scene, sensor, radiance, sky, scene.camera.frame), sensor)


def light_on_detector(scene: Scene, radiance: Radiance, sky: NDArray[np.float32] | None) -> NDArray[np.float32]:
    """Return the light (H, W) that falls on the pixels of a detector of one channel, in the unit range of the camera's
    own exposure, which is not metered; neither noise nor an end of the range."""
    sensor = replace(scene.sensor, channels="mono")
    light = _collected(scene, sensor, radiance, sky, scene.camera.frame)[..., 0]
    return np.asarray(light * np.float32(sensor.exposure))


def _collected(
    scene: Scene, sensor: Sensor, radiance: Radiance, sky: NDArray[np.float32] | None, region: Region
) -> NDArray[np.float32]:
    """Return the light (H, W, C) that the detector's channels take in, in the `region`."""
    shown = radiance.region & region
    rgba = radiance.rgba[shown.within(radiance.region).slices]
    slices = shown.within(region).slices
    front = collect(rgba[..., :3], sensor)
    if sky is None:
        light = np.zeros((*region.shape, front.shape[-1]), np.float32)
        light[slices] = front
    else:
        light = collect(sky, sensor)
        light[slices] *= 1 - rgba[..., 3:]
        light[slices] += front
    blind = scene.camera.blind(region)
    if blind is not None:
        light[blind] = 0
    return through_optics(light, scene.optics, scene.camera, exposure=sensor.exposure, region=region)


def through_optics(
    light: NDArray[np.float32],
    optics: Optics,
    camera: Camera,
    *,
    exposure: float,
    region: Region | None = None,
) -> NDArray[np.float32]:
    """`light` (H, W, C) of the frame, or its `region`, as it falls there on the detector; the same array where the
    optics do nothing.

    Lens and housing dim and spread it. Everything but the artist's bloom is linear in the light. `exposure` scales it
    to the unit range, in which bloom has its threshold.
    """
    image = light[..., 0] if light.shape[-1] == 1 else light
    gain = vignetting_gain(camera, optics)
    if gain is not None:
        gain = gain if region is None else gain[region.slices]
        image = image * (gain if image.ndim == 2 else gain[..., None])
    if optics.psf_sigma > 0:
        # Mirrored at the rim: as much comes in from beyond the frame as goes out, and no rim is dark.
        image = convolved(image, optics.psf_sigma**2, mirrored=True)
    if optics.glare > 0:
        image = scatter(image, optics)
    if optics.bloom_intensity > 0:
        image = bloom(image, optics, exposure)
    return image.reshape(light.shape)


def vignetting_gain(camera: Camera, optics: Optics) -> NDArray[np.float32] | None:
    """Return (H, W) the gain at each pixel's centre, read-only; None where it is 1 throughout."""
    if not (optics.cos_fourth or any(optics.vignetting)):
        return None
    return _gain(camera, optics.cos_fourth, optics.vignetting)


@lru_cache(maxsize=2)
def _gain(camera: Camera, cos_fourth: bool, coefficients: tuple[float, float, float]) -> NDArray[np.float32]:
    gain = np.ones(camera.frame.shape)
    if cos_fourth:  # of the angle to the axis of the true ray, before the lens distorted it
        xy = camera.centres(camera.frame)
        gain /= (1 + xy[..., 0] ** 2 + xy[..., 1] ** 2) ** 2
    if any(coefficients):
        v, u = np.indices(gain.shape) + 0.5
        gain *= polynomial_gain(camera, coefficients, np.stack([u, v], -1))
    return frozen(gain, np.float32)


def scatter(light: Image, optics: Optics) -> Image:
    """`light` with the share `optics.glare` of it in the halo, which is normalised over the infinite plane.

    This is veiling glare: lens surfaces and housing scatter a share of all light, bright or dim, far aside.
    """
    height, width = light.shape[:2]
    halo = halo_scales(optics.glare_core, optics.glare_falloff, LARGEST * float(np.hypot(width, height)))
    scattered = spread(light, [(variance, weight * optics.glare) for variance, weight in halo])
    scattered += np.float32(1 - optics.glare) * light
    return scattered


@lru_cache(maxsize=16)
def halo_scales(core: float, falloff: float, widest: float) -> tuple[Scale, ...]:
    """Return the Gaussians that the halo is made of; those with a standard deviation above `widest` pixels are skipped.

    The halo's profile (1 + (r / core)^2) ** (-falloff / 2) is a mixture of Gaussians: with t = falloff / 2,
    a^-t = integral of s^(t - 1) exp(-s a) ds / Gamma(t), so each s adds a Gaussian of variance core^2 / (2 s), and the
    energies follow a Gamma distribution of t - 1. In log(s) the integrand is smooth and ends softly at both sides:
    there the plain sum of equal steps converges exponentially.
    """
    from scipy.special import gammainccinv, gammaincinv  # not above: scipy is slow to load, and few need it

    shape = falloff / 2 - 1
    first, last = gammaincinv(shape, WIDEST), gammainccinv(shape, NARROWEST)
    s = np.exp(np.arange(np.log(first), np.log(last) + STEP, STEP))
    energy = s**shape * np.exp(-s)
    scales = zip((core**2 / (2 * s)).tolist(), (energy / energy.sum()).tolist(), strict=True)
    return tuple((variance, weight) for variance, weight in scales if variance < widest**2)


def bloom(light: Image, optics: Optics, exposure: float) -> Image:
    """`light` with its glow; `exposure` scales it to the unit range.

    Game engines put this glow around bright pixels: an artist's means to match their pictures, not physics. Light below
    the threshold is not scattered (for that see `scatter`). It follows the behaviour of Unity's High Definition Render
    Pipeline: a soft threshold on the brightest channel, Gaussians that double in width from one resolution to the next,
    each blended over the last by the scatter, and an intensity of 2^i - 1. A bright pixel loses the light that its glow
    adds.
    """
    if optics.bloom_intensity <= 0:
        return light
    bright = light * _excess(light, optics.bloom_threshold / exposure)
    octaves = max(int(np.log2(max(light.shape[:2]) / 2 / SMALLEST)), 1)
    low, high = SCATTER
    wide = low + (high - low) * optics.bloom_scatter
    shares = [(1 - wide) * wide**i for i in range(octaves - 1)] + [wide ** (octaves - 1)]
    variances = [FIRST_VARIANCE * (4 ** (i + 1) - 1) / 3 for i in range(octaves)]
    intensity = np.float32(2**optics.bloom_intensity - 1)
    glow = spread(bright, list(zip(variances, shares, strict=True)))
    return np.asarray(light + intensity * (glow - bright))


def _excess(light: Image, threshold: float) -> Image:
    """Return (H, W) or (H, W, 1): the share of each pixel's light that counts as bright."""
    brightest: Image = light if light.ndim == 2 else np.max(light, -1, keepdims=True)
    knee = max(KNEE * threshold, TINY)
    onset = np.clip(brightest - (threshold - knee), 0, 2 * knee) ** 2 / (4 * knee)
    excess = np.maximum(onset, brightest - threshold) / np.maximum(brightest, TINY)
    return np.asarray(excess, np.float32)


def spread(light: Image, scales: Sequence[Scale]) -> Image:
    """Return the sum of `light` convolved with each Gaussian of `scales`, of any width, times its weight.

    Beyond the frame all is black; what falls there is lost, and nothing else. Narrow Gaussians are convolved at full
    resolution, wide ones at a half, a quarter ...: a halving and its doubling each convolve with the binomial kernel
    (1, 4, 6, 4, 1) / 16, whose response is zero at the frequency that the halving folds onto the mean, so that every
    pixel's light counts in full wherever it lies. Source of the pyramid: P. J. Burt, "Fast filter transforms for image
    processing" (1981).
    """
    import cv2  # not above: cv2 is slow to load, and few need it

    spreading = np.zeros_like(light)
    for variance, weight in scales:
        if variance < DIRECT:
            spreading += convolved(light, variance, weight)
    wide = [((variance - HALVING) / 4, weight) for variance, weight in scales if variance >= DIRECT]
    if wide:
        height, width = light.shape[:2]
        right, below = PAD + width % 2, PAD + height % 2
        padded = cv2.copyMakeBorder(light, PAD, below, PAD, right, cv2.BORDER_CONSTANT)
        coarse = spread(np.asarray(cv2.pyrDown(padded), np.float32), wide)
        spreading += cv2.pyrUp(coarse)[PAD : PAD + height, PAD : PAD + width]
    return spreading


def convolved(light: Image, variance: float, weight: float = 1.0, *, mirrored: bool = False) -> Image:
    """Return `light` convolved at full resolution with a Gaussian, times `weight`. Beyond the rim it is dark, or
    `mirrored`."""
    import cv2  # not above: see spread

    kernel = gaussian(variance)
    border, down = cv2.BORDER_REFLECT if mirrored else cv2.BORDER_CONSTANT, kernel * np.float32(weight)
    return np.asarray(cv2.sepFilter2D(light, -1, kernel, down, borderType=border), np.float32)


@lru_cache(maxsize=256)
def gaussian(variance: float) -> Image:
    """Return (N,) samples of a Gaussian, of sum 1 and exactly that variance on the grid, however narrow.

    Samples of exp(-x^2 / (2 variance)) have that variance only from about a pixel up; below, a wider one is sampled.
    """
    n = np.arange(
        -int(KERNEL_SIGMAS * np.sqrt(variance) + KERNEL_SIGMAS),
        int(KERNEL_SIGMAS * np.sqrt(variance) + KERNEL_SIGMAS) + 1,
    )
    exponent = 1 / (2 * variance)
    if variance < EXACT:
        from scipy.optimize import brentq  # not above: scipy is slow to load, and few need it

        wide = exponent / 100
        while _variance(n, wide) <= variance:  # the narrower it is, the more does the sampled one differ
            wide /= 10
        exponent = brentq(lambda e: _variance(n, e) - variance, wide, exponent, xtol=1e-15)
    samples = np.exp(-exponent * n**2)
    samples = samples[samples > NEGLIGIBLE]
    return np.asarray(samples / samples.sum(), np.float32)


def _variance(n: NDArray[np.int64], exponent: float) -> float:
    samples = np.exp(-exponent * n**2)
    return float((samples * n**2).sum() / samples.sum())
