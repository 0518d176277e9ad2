"""Bloom: the glow that game engines put around bright pixels, an artist's means to match their pictures.

Not physics: light below the threshold is not scattered (for that see `glare`). It follows the behaviour of Unity's High
Definition Render Pipeline: a soft threshold on the brightest channel, Gaussians that double in width from one
resolution to the next, each blended over the last by the scatter, and an intensity of 2^i - 1. A bright pixel loses the
light that its glow adds.
"""

import numpy as np

from spin_usd.scene.sensor import Optics
from spin_usd.sensor.spread import Image, spread

KNEE = 0.5  # of the threshold: half the width of its soft onset
FIRST_VARIANCE = 11.4  # pixels squared: a Gaussian of nine taps at half the resolution
SCATTER = (0.05, 0.95)  # what the ends of the setting's range 0 to 1 mean
TINY = 1e-30  # what a division by nothing is saved by
SMALLEST = 4  # pixels of the longer side at the last resolution


def bloom(light: Image, optics: Optics, exposure: float) -> Image:
    """`light` with its glow; `exposure` scales it to the unit range."""
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
