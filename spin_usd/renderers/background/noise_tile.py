"""One tile of noise that repeats: of waves of one octave in all directions."""

from functools import lru_cache

import numpy as np

from spin_usd.renderers.background.bilinear import blended
from spin_usd.renderers.background.elementary import TURN, Float32, cosines

TILE = TURN  # texels
MEAN_WAVE = 8.0  # texels
WAVES = 360  # that the tile is made of
LEAST_CYCLES, MOST_CYCLES = 24, 44  # of each, over the tile
SPREAD = 1.0199618  # of a tile of these waves, in place of 1: a sum of them would differ between processors


@lru_cache(maxsize=1)
def tile() -> Float32:
    """Return (TILE + 1, TILE + 1): repeats; mean 0, variance 1, normally distributed."""
    wave = cosines().astype(np.float32)
    steps, total = np.arange(TILE), np.zeros((TILE, TILE), np.float32)
    for across, down, phase in _waves():
        a, b = (steps * across + phase) % TURN, steps * down % TURN
        quarter = TURN // 4
        total += wave[b][:, None] * wave[a] - wave[b - quarter][:, None] * wave[a - quarter]
    total *= np.float32((2 / WAVES) ** 0.5 / SPREAD)
    return np.pad(total, (0, 1), mode="wrap")


def _waves() -> list[tuple[int, int, int]]:
    """Return cycles across and down, and phase, of each wave: by a generator of whole numbers of 64 bits (Knuth's
    MMIX)."""
    state, found = 20, list[tuple[int, int, int]]()
    while len(found) < WAVES:
        numbers = []
        for _ in range(3):
            state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
            numbers.append(state >> 40)
        across, down = numbers[0] % (MOST_CYCLES + 1), numbers[1] % (2 * MOST_CYCLES + 1) - MOST_CYCLES
        if LEAST_CYCLES**2 <= across * across + down * down <= MOST_CYCLES**2:
            found.append((across, down, numbers[2] % TURN))
    return found


def sampled(u: Float32, v: Float32) -> Float32:
    """Return the tile bilinearly at columns and rows from 0 up, wherever they repeat."""
    table = tile().ravel()
    column, row = u.astype(np.int32), v.astype(np.int32)
    fx, fy = u - column.astype(np.float32), v - row.astype(np.float32)
    column &= TILE - 1
    row &= TILE - 1
    row *= TILE + 1
    row += column
    return blended(table, TILE + 1, row.astype(np.intp), fx, fy)
