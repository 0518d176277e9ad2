"""Detail finer than a planet's images: noise without end, cut off at the finest wave that a pixel resolves.

Layers of one tile, each four times as fine as the one before. The tile lies on a Mercator map, which keeps shapes,
about the planet's own axis, and near its poles about another.
"""

from functools import lru_cache

import numpy as np

from spin_usd.renderers.background.latlong import TAU, Float32, bilinear

TILE = 512  # texels
COARSE, FINE = 24.0, 6.0  # texels: the longest and shortest waves of the tile
RATIO = 4  # of the wavelengths of neighbouring layers
GAIN = 0.62  # of their amplitudes
MAX_LAYERS = 8
NEGLIGIBLE = 0.02  # of its amplitude, below which a layer is skipped
POLAR = (0.75, 0.85)  # sine of the latitude where one map fades into the other
SEED = 20


@lru_cache(maxsize=1)
def tile() -> Float32:
    """Return (1, TILE + 1, TILE + 1): repeats, mean 0, variance 1, normally distributed, waves of FINE to COARSE."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(TILE), np.fft.fftfreq(TILE)))
    band = (frequency > 1 / COARSE) & (frequency < 1 / FINE)
    weight = np.where(band, np.maximum(frequency, 1 / TILE) ** -1.5, 0)
    noise = np.random.default_rng(SEED).standard_normal((TILE, TILE))
    shaped = np.fft.ifft2(np.fft.fft2(noise) * weight).real
    wrapped = np.pad((shaped / shaped.std()).astype(np.float32), (0, 1), mode="wrap")
    return np.asarray(wrapped[None])


def detail(normal: list[Float32], footprint: Float32, coarsest: float) -> tuple[Float32, Float32]:
    """Noise (N,) on the unit sphere, and how much of its whole variance of 1 the pixel resolves (N,).

    normal: x, y, z (N,) of each point; footprint (N,): what its pixel spans, and coarsest: the longest wave, radians.
    """
    x, y, z = normal
    finest = float(footprint.min())
    noise, variance = _about_axis(x, y, z, footprint, coarsest, finest)
    beyond = np.flatnonzero(np.abs(z) > POLAR[0])
    if len(beyond):
        polar, _ = _about_axis(y[beyond], z[beyond], x[beyond], footprint[beyond], coarsest, finest)
        share = np.clip((np.abs(z[beyond]) - POLAR[0]) / np.float32(POLAR[1] - POLAR[0]), 0, 1)
        keep = 1 - share
        noise[beyond] = (keep * noise[beyond] + share * polar) / np.sqrt(keep * keep + share * share)
    return noise, variance


def _about_axis(
    x: Float32, y: Float32, z: Float32, footprint: Float32, coarsest: float, finest: float
) -> tuple[Float32, Float32]:
    """`detail` on the Mercator map about z."""
    u = np.asarray(np.arctan2(y, x) / TAU, np.float32)
    z = np.clip(z, np.float32(-0.9999), np.float32(0.9999))
    v = np.asarray(np.log((1 + z) / (1 - z)), np.float32) * np.float32(0.25 / np.pi)
    noise, variance = np.zeros_like(u), np.zeros_like(u)
    repeats = max(round(2 * np.pi * COARSE / (TILE * coarsest)), 1)
    for layer in range(MAX_LAYERS):
        shortest = 2 * np.pi * FINE / (TILE * repeats)
        share = (1 - GAIN**2) * GAIN ** (2 * layer)
        if _resolved(finest, shortest) < NEGLIGIBLE:
            break
        scale = np.float32(repeats * TILE)
        shift = np.float32(TILE * 0.37 * (layer + 1))
        resolved = _resolved(footprint, shortest)
        (wave,) = bilinear(tile(), _repeated(u * scale + shift), _repeated(v * scale + shift))
        noise += np.float32(share**0.5) * resolved * wave
        variance += np.float32(share) * resolved * resolved
        repeats *= RATIO
    return noise, variance


def _repeated(place: Float32) -> Float32:
    """Places (N,) in texels, brought to 0 to TILE."""
    return np.asarray(place - np.floor(place * np.float32(1 / TILE)) * np.float32(TILE))


def _resolved(footprint: Float32 | float, shortest: float) -> Float32:
    """Return the share that is resolved of the amplitude of waves, the shortest of which are `shortest`: a fifth at
    Nyquist's limit."""
    ratio = np.square(footprint / np.float32(shortest) * np.float32(2.8))
    return np.asarray(1 / (1 + ratio * ratio), np.float32)
