"""Tango's own textures: an atlas of cells, one of which each of its modelled cells wears; tileable, 8-bit.

Images are (H, W, C) float64 in 0 to 1, the top row first; st (0, 0) is the lower left corner.
"""

from collections.abc import Callable

import numpy as np
from materials.cells import CELL_PIXELS, bus_bars, metal
from materials.values import Array

from spin_usd.scene.derived import srgb
from tango import dimensions as d
from tango.mockup_textures import mockup_film_normal, mockup_panel

SILICON = np.array([0.030, 0.042, 0.095])  # linear: blue-black, as an anti-reflection coating leaves it
SILVER = np.array([0.62, 0.62, 0.64])


def solar_cell() -> Array:
    """An atlas of cells, each of its own shade, with fingers and bus bars; sRGB."""
    rng, shape = np.random.default_rng(21), (d.CELL_TONES[1], d.CELL_TONES[0])
    tones = (0.55 + 0.9 * rng.random((*shape, 1))) * (0.85 + 0.3 * rng.random((*shape, 3)))
    shade = np.kron(tones, np.ones((CELL_PIXELS[1], CELL_PIXELS[0], 1))) * SILICON
    everywhere = np.tile(metal(), d.CELL_TONES[::-1])[..., None]
    return srgb.encode(shade + everywhere * (SILVER - shade))


def solar_cell_metal() -> Array:
    """1 on the bus bars, 0 on the cell."""
    return np.tile(bus_bars(), d.CELL_TONES[::-1])[..., None]


TEXTURES: dict[str, Callable[[], Array]] = {
    "solar_cell.png": solar_cell,
    "solar_cell_metal.png": solar_cell_metal,
    "mockup_panel.png": mockup_panel,
    "mockup_film_normal.png": mockup_film_normal,
}
