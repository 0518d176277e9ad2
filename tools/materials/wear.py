"""What handling and dust leave on a surface: smudges, wiping marks, scratches and specks, as one tileable texture."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

PIXELS = 256
LEVELS = 32  # few, so that the file is small
METRES = 0.34  # what one copy covers
FINGERPRINTS, SCRATCHES, SPECKS = 26, 40, 500


def wear() -> NDArray[np.float64]:
    """How worn each place is, (H, W, 1) of 0 to 1 and half in the mean: rough where it is high, wiped where low."""
    rng = np.random.default_rng(31)
    worn = 0.10 * _clouds(rng, 20.0) + 0.06 * _clouds(rng, 5.0) + 0.02 * _wiped(rng)
    for _ in range(FINGERPRINTS):
        worn += 0.22 * (0.5 + rng.random()) * _spot(rng, 0.0075, 0.0055)
    for _ in range(SCRATCHES):
        worn -= 0.16 * rng.random() * _spot(rng, 0.022 * rng.random() + 0.004, 0.0009)
    specks = rng.random((PIXELS, PIXELS)) < SPECKS / PIXELS**2
    worn += 1.2 * gaussian_filter(specks.astype(float), 0.7, mode="wrap")
    worn += 0.5 - worn.mean()
    return np.clip(np.round(worn * LEVELS) / LEVELS, 0, 1)[..., None]


def _clouds(rng: np.random.Generator, blur: float) -> NDArray[np.float64]:
    """Noise of this scale in pixels, standard deviation 1."""
    noise = gaussian_filter(rng.normal(size=(PIXELS, PIXELS)), blur, mode="wrap")
    return np.asarray(noise / noise.std())


def _wiped(rng: np.random.Generator) -> NDArray[np.float64]:
    """Streaks in two directions, as a cloth leaves them, standard deviation 1."""
    noise = rng.normal(size=(2, PIXELS, PIXELS))
    streaks = gaussian_filter(noise[0], (1.0, 16.0), mode="wrap") + gaussian_filter(noise[1], (14.0, 1.2), mode="wrap")
    return np.asarray(streaks / streaks.std())


def _spot(rng: np.random.Generator, length: float, width: float) -> NDArray[np.float64]:
    """A soft ellipse somewhere on the torus, turned anyhow; half axes in metres."""
    at, angle = rng.random(2) * PIXELS, np.pi * rng.random()
    away = (np.arange(PIXELS) + 0.5 - at[:, None] + PIXELS / 2) % PIXELS - PIXELS / 2
    y, x = np.meshgrid(away[0], away[1], indexing="ij")
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    scale = PIXELS / METRES
    return np.asarray(np.exp(-(((along / (length * scale)) ** 2 + (across / (width * scale)) ** 2) ** 2)))
