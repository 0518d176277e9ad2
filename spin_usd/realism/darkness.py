"""Black level and noise of a picture, from its darkest blocks; noise against signal, from its flattest blocks.

The pixels that choose a block are never those that are measured in it: the darkest of many noisy blocks would be
darker than the room, and the flattest would have too little noise. Source of the photon transfer: EMVA Standard 1288,
"Standard for Characterization of Image Sensors and Cameras", release 4.0.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spin_usd.basics.arrays import Float

BLOCK = 16
DARKEST = 0.003  # share of the blocks that show the room, at least: in some pictures only the target has dark pixels
LEAST_BLOCKS = 4
MARGIN = 3.0  # standard deviations of a block's mean
ROUNDING = 1 / 12  # variance of rounding to whole steps
FLAT_BLOCK = 8
FLATTEST = 0.3  # share of a bin's blocks
ROUGH = 3.0  # times the texture of flat blocks: a bin of a brightness that only edges have has none
BIN = 8.0  # grey
LAPLACIAN = 36  # its mean square over the variance of white noise
LEAST_IN_BIN = 12
LEAST_BINS = 3
BRIGHTEST = 235.0  # grey: above it noise is cut off


@dataclass(frozen=True, kw_only=True)
class Darkness:
    """A picture's black level and noise in the dark, in its own pixels; steps of 8 bits."""

    level: float
    noise: float
    """Standard deviation: differences of neighbours over the root of 2, without the rounding's part."""
    across: float
    """Correlation of the noise of neighbours in a row."""
    down: float
    """Correlation of the noise of neighbours in a column."""
    borders: float
    """Correlation of neighbours in a row on either side of a border of JPEG's blocks: none if it is of their loss."""
    rows: float
    """Standard deviation of whole rows' levels within a block over the noise; 0 without a pattern."""
    columns: float


def darkness(grey: NDArray[np.float32], rounding: float = ROUNDING) -> Darkness:
    """Return the darkness of a picture (H, W), each side at least BLOCK pixels. `rounding`: the variance of its
    rounding in the dark, which is not that of whole steps where an encoding was undone."""
    blocks = _blocks(grey, BLOCK)
    chosen_by, measured = blocks[:, ::2].mean((1, 2)), blocks[:, 1::2]
    low = float(np.quantile(chosen_by, DARKEST))
    spread = float(np.sqrt(np.square(np.diff(blocks[chosen_by <= low], axis=2)).mean() / 2))
    count = max(int((chosen_by <= low + MARGIN * spread / BLOCK).sum()), LEAST_BLOCKS)
    dark = np.argsort(chosen_by, kind="stable")[:count]
    level = float(measured[dark].mean())
    rest = blocks[dark] - blocks[dark].mean((1, 2), keepdims=True)
    difference = float(np.square(np.diff(measured[dark], axis=2)).mean() / 2)
    noise = float(np.sqrt(max(difference - rounding, 0.0)))
    variance = max(float(np.square(rest).mean()), 1e-12)
    return Darkness(
        level=level,
        noise=noise,
        across=float((rest[:, :, 1:] * rest[:, :, :-1]).mean()) / variance,
        down=float((rest[:, 1:] * rest[:, :-1]).mean()) / variance,
        borders=float((rest[:, :, BLOCK // 2] * rest[:, :, BLOCK // 2 - 1]).mean()) / variance,
        rows=_pattern(rest.mean(2), variance),
        columns=_pattern(rest.mean(1), variance),
    )


def shot_noise(grey: NDArray[np.float32], dark: Darkness) -> float:
    """Return the slope k of the photon transfer: the noise's variance is its value in the dark plus k times the signal,
    in steps of 8 bits. NaN for a picture with too few flat, lit blocks."""
    half, blocks = FLAT_BLOCK // 2, _flat_blocks(grey)
    mean, noise = blocks.mean((1, 2)), _laplacian(blocks)
    room = noise[np.abs(mean - dark.level) < max(dark.noise / half, 0.5)]
    if len(room) < LEAST_IN_BIN:
        return float("nan")
    unit = float(np.median(room))  # of the noise in the dark, whatever correlates it
    scale = (dark.noise**2 + ROUNDING) / unit if unit else 1 / LAPLACIAN
    quarters = blocks.reshape(-1, 2, half, 2, half).mean((2, 4)).reshape(-1, 4)
    texture = np.ptp(quarters, axis=1)  # means of pixels do not depend on their differences
    lit = (mean >= dark.level + BIN / 2) & (mean < BRIGHTEST)
    flat_enough = lit & (texture <= ROUGH * np.quantile(texture[lit], FLATTEST)) if lit.any() else lit
    signals, variances, weights = [], [], []
    for low in np.arange(dark.level + BIN / 2, BRIGHTEST, BIN):
        here = np.flatnonzero(flat_enough & (mean >= low) & (mean < low + BIN))
        if len(here) < LEAST_IN_BIN:
            continue
        flat = here[np.argsort(texture[here])[: max(int(FLATTEST * len(here)), LEAST_IN_BIN // 2)]]
        signals.append(float(mean[flat].mean()) - dark.level)
        variances.append((float(np.median(noise[flat])) - unit) * scale)
        weights.append(len(flat) ** 0.5 / max(signals[-1], 1.0) ** 0.5)
    if len(signals) < LEAST_BINS:
        return float("nan")
    x, y, w = (np.array(each) for each in (signals, variances, weights))
    return float((w * x * y).sum() / (w * x * x).sum())


def flat_noise(grey: NDArray[np.float32]) -> float:
    """Return the noise of a flat field (H, W) as the photon transfer measures it: in proportion to the variance."""
    return float(np.median(_laplacian(_flat_blocks(grey))))


def _flat_blocks(grey: NDArray[np.float32]) -> Float:
    """Return (N, FLAT_BLOCK, FLAT_BLOCK) blocks that lie across those of a JPEG."""
    return _blocks(grey[FLAT_BLOCK // 2 :, FLAT_BLOCK // 2 :], FLAT_BLOCK)


def _laplacian(blocks: Float) -> Float:
    """Return (N,) the mean square of the difference of two Laplacians of blocks (N, side, side), which slopes and even
    curves leave zero. Source: J. Immerkaer, "Fast noise variance estimation" (1996)."""
    across = blocks[:, :, :-2] - 2 * blocks[:, :, 1:-1] + blocks[:, :, 2:]
    both = across[:, :-2] - 2 * across[:, 1:-1] + across[:, 2:]
    return np.asarray(np.square(both).mean((1, 2)))


def _blocks(grey: NDArray[np.float32], side: int) -> Float:
    """Return (N, side, side): the picture in blocks, from its top left corner."""
    rows, columns = (length // side for length in grey.shape)
    cut = grey[: rows * side, : columns * side].astype(np.float64)
    return cut.reshape(rows, side, columns, side).swapaxes(1, 2).reshape(-1, side, side)


def _pattern(means: Float, variance: float) -> float:
    """Return the standard deviation of lines' means (N, BLOCK) beyond the part of white noise, over the noise."""
    beyond = float(np.square(means).mean()) - variance / BLOCK * (1 - 1 / BLOCK)
    return float(np.sqrt(max(beyond, 0.0) / variance))
