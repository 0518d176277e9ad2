"""Pictures of solar cells: an area of cells with gaps between them, and what every cell has on it.

Pixels are half a millimetre.
"""

import numpy as np

from materials.values import Array, Colour
from spin_usd.scene.derived import srgb

CELL_PIXELS = (160, 80)  # along s and t
GAP_PIXELS = 4
CROP_PIXELS = 12  # of two corners, along both edges
CELLS = (4, 6)  # in one copy of the picture, along s and t
PIXEL = 0.0005  # metres
AREA = (CELLS[0] * (CELL_PIXELS[0] + GAP_PIXELS) * PIXEL, CELLS[1] * (CELL_PIXELS[1] + GAP_PIXELS) * PIXEL)
FINGER = 0.12  # of a pixel, what of it a finger covers
TONES = (0.8, 1.2)  # of cells, against their mean


def metal() -> Array:
    """One cell (H, W): 1 on two bus bars along s near its long edges, FINGER on fingers across, every 2 mm."""
    width, height = CELL_PIXELS
    bars, fingers = bus_bars(), np.ones(height)[:, None] * (np.arange(width) % 4 == 1)
    return np.asarray(np.maximum(bars, FINGER * fingers))


def bus_bars() -> Array:
    """One cell (H, W): 1 on the bus bars, 0 elsewhere."""
    width, height = CELL_PIXELS
    rows = np.isin(np.arange(height), (7, 8, 9, height - 10, height - 9, height - 8))
    return rows[:, None].astype(float) * np.ones(width)


def array_colour(cell: Colour, silver: Colour, between: Colour) -> Array:
    """An area of cells of `cell`, each a little lighter or darker; sRGB."""
    tones = np.random.default_rng(22).uniform(*TONES, (CELLS[1], CELLS[0], 1))
    tones /= tones.mean()
    shade = np.kron(tones, np.ones((*_outline().shape, 1))) * np.array(cell)
    covered = _repeated(_in_gaps(metal()))[..., None]
    on_cell = shade + covered * (np.array(silver) - shade)
    return srgb.encode(np.where(_repeated(_outline())[..., None] > 0, on_cell, np.array(between)))


def array_bars() -> Array:
    """The same area: 1 on the bus bars, 0 elsewhere."""
    return _repeated(_in_gaps(bus_bars()))[..., None]


def _outline() -> Array:
    """One cell with half of the gaps around it: 1 where it is; two of its corners are cropped."""
    width, height = CELL_PIXELS
    rows, columns = np.meshgrid(np.arange(height), np.arange(width), indexing="ij")
    there = np.minimum(rows + columns, rows + width - 1 - columns) >= CROP_PIXELS
    return _in_gaps(there.astype(float))


def _in_gaps(cell: Array) -> Array:
    return np.pad(cell, GAP_PIXELS // 2)


def _repeated(one: Array) -> Array:
    return np.tile(one, CELLS[::-1])
