"""The textures of the library: tileable, 8-bit, the same from run to run.

Images are (H, W, C) float64 in 0 to 1, the top row first; st (0, 0) is the lower left corner.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import gaussian_filter
from scipy.spatial import Delaunay

from materials import cells
from materials import optical_constants as constants
from materials.colours import BETWEEN_CELLS, CELL, CELL_BARE, PRINTED, oxide
from materials.values import Array
from materials.wear import wear
from spin_usd.scene.derived import srgb

FOIL_PIXELS = 448
BRUSHED_PIXELS = 128
WEAVE_PIXELS, WEAVE_THREADS = 64, 4  # of a plain weave, along each axis
TWILL_PIXELS, TWILL_TOWS = 128, 8
TILE_PIXELS, TILES = 32, 8  # of mirrors, along each axis: a gap is a pixel
MILLED_PIXELS, MILLED_MARKS = 128, 16
TINT_PIXELS, TINT_OXIDE = 128, (12.0, 62.0)  # nanometres
PATCH_PIXELS = 64


def foil_normal() -> Array:
    """Crumpled foil: flat facets between sharp creases at three scales, one within another."""
    slopes = np.zeros((FOIL_PIXELS, FOIL_PIXELS, 2))
    for seed, (count, steepness, blur) in enumerate(((60, 0.19, 1.6), (420, 0.15, 0.9), (2600, 0.06, 0.7))):
        height = gaussian_filter(_facets(count, seed), blur, mode="wrap")
        gradient = _gradient(height)
        slopes += gradient * steepness / gradient.std()
    return _normals(slopes)


def brushed_roughness() -> Array:
    """Streaks along s: 0.5 in the mean."""
    streaks = _streaks(11)
    return np.clip(0.5 + 0.15 * streaks, 0, 1)[..., None]


def brushed_normal() -> Array:
    """The grooves of the same brush: they tilt across the streaks only."""
    slopes = np.zeros((BRUSHED_PIXELS, BRUSHED_PIXELS, 2))
    slopes[..., 1] = 0.03 * _streaks(12)
    return _normals(slopes)


def milled_normal() -> Array:
    """Marks of a face mill in two passes: arcs, one after another, that end at the next pass."""
    at = (np.arange(MILLED_PIXELS) + 0.5) / MILLED_PIXELS
    y, x = np.meshgrid(at, at, indexing="ij")
    across = (2 * y) % 1 - 0.5
    arc = np.sqrt(0.36 - across**2)
    height = np.sin(2 * np.pi * MILLED_MARKS * (x - arc * np.where(y < 0.5, 1, -1)))
    gradient = _gradient(height)
    return _normals(_centred(0.08 * gradient / gradient.std()))


def weave_normal() -> Array:
    """A plain weave: threads that go over and under one another by turns."""
    at = (np.arange(WEAVE_PIXELS) + 0.5) / WEAVE_PIXELS * WEAVE_THREADS
    y, x = np.meshgrid(at, at, indexing="ij")
    warp = np.sin(np.pi * y) * np.where(np.floor(x) % 2 == 0, 1, -1) + 1.2 * np.sqrt(np.abs(np.sin(np.pi * x)))
    weft = -np.sin(np.pi * x) * np.where(np.floor(y) % 2 == 0, 1, -1) + 1.2 * np.sqrt(np.abs(np.sin(np.pi * y)))
    gradient = _gradient(gaussian_filter(np.maximum(warp, weft), 1.0, mode="wrap"))
    return _normals(_centred(0.35 * gradient / gradient.std()))


def twill_normal() -> Array:
    """A 2 x 2 twill of flat tows: each tilts to where it dives below the other one."""
    over, along, across = _twill()
    bend = np.cos(np.pi * along) * 0.10
    lean = -np.sin(2 * np.pi * (across - 0.5)) * 0.05
    first, second = np.where(over, lean, bend), np.where(over, bend, lean)
    return _normals(_centred(np.stack([first, second], axis=-1)))


def twill_tone() -> Array:
    """The same twill: tows of one direction are darker than those of the other, and dark where they dive; 1 is the
    lightest."""
    over, along, _ = _twill()
    return np.clip(np.where(over, 1.0, 0.62) * (0.7 + 0.3 * np.sin(np.pi * along)), 0, 1)[..., None]


def mirror_tiles() -> Array:
    """Square tiles: 1 on them, 0.05 in the gaps."""
    one = np.ones((TILE_PIXELS, TILE_PIXELS))
    one[0], one[:, 0] = 0.05, 0.05
    return np.tile(one, (TILES, TILES))[..., None]


def mirror_tiles_normal() -> Array:
    """The same tiles: each leans its own way, by at most a degree."""
    leans = np.random.default_rng(47).integers(-2, 3, (TILES, TILES, 2)) / 127.5
    return _normals(np.kron(_centred(leans), np.ones((TILE_PIXELS, TILE_PIXELS, 1))))


def heat_tint() -> Array:
    """Bands across t of an oxide that grew where the metal was hot: the colours of thin films; sRGB."""
    thin, thick = TINT_OXIDE
    turn = 2 * np.pi * (np.arange(TINT_PIXELS) + 0.5) / TINT_PIXELS
    depths = thin + (thick - thin) * (0.5 - 0.5 * np.cos(turn))
    bands = np.array([oxide(constants.NIOBIUM.index, depth) for depth in depths])
    return srgb.encode(np.repeat(bands[:, None], 4, axis=1))


def patch_antenna() -> Array:
    """A square patch of metal on a laminate, in one corner cut for the polarisation: 1 on it."""
    patch = np.zeros((PATCH_PIXELS, PATCH_PIXELS))
    patch[12:-12, 12:-12] = 1
    rows, columns = np.meshgrid(np.arange(PATCH_PIXELS), np.arange(PATCH_PIXELS), indexing="ij")
    patch[rows + columns < 32], patch[rows + columns > 2 * PATCH_PIXELS - 34] = 0, 0
    patch[30:34, 20:24] = 0  # where it is fed
    return patch[..., None]


TEXTURES: dict[str, Callable[[], Array]] = {
    "foil_normal.png": foil_normal,
    "brushed_roughness.png": brushed_roughness,
    "brushed_normal.png": brushed_normal,
    "wear.png": wear,
    "milled_normal.png": milled_normal,
    "weave_normal.png": weave_normal,
    "twill_normal.png": twill_normal,
    "twill_tone.png": twill_tone,
    "mirror_tiles.png": mirror_tiles,
    "mirror_tiles_normal.png": mirror_tiles_normal,
    "heat_tint.png": heat_tint,
    "patch_antenna.png": patch_antenna,
    "cell_array.png": lambda: cells.array_colour(CELL, PRINTED, BETWEEN_CELLS),
    "cell_array_bare.png": lambda: cells.array_colour(CELL_BARE, PRINTED, BETWEEN_CELLS),
    "cell_array_bars.png": cells.array_bars,
}


def _facets(count: int, seed: int) -> Array:
    """A height over the unit torus that is linear on each triangle between `count` random points."""
    rng = np.random.default_rng(seed)
    sites, heights = rng.random((count, 2)), rng.random(count)
    shifts = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
    around = (sites[None] + shifts[:, None]).reshape(-1, 2)
    at = (np.arange(FOIL_PIXELS) + 0.5) / FOIL_PIXELS
    surface = LinearNDInterpolator(Delaunay(around), np.tile(heights, len(shifts)))
    x, y = np.meshgrid(at, at)
    height: Array = surface(np.stack([x, y], axis=-1))
    return height


def _gradient(height: Array) -> Array:
    """Slopes along columns and rows, around the torus."""
    return np.stack([np.roll(height, -1, axis) - np.roll(height, 1, axis) for axis in (1, 0)], axis=-1)


def _streaks(seed: int) -> Array:
    """Noise stretched along the rows, standard deviation 1."""
    noise = np.random.default_rng(seed).normal(size=(BRUSHED_PIXELS, BRUSHED_PIXELS))
    streaks = gaussian_filter(noise, (0.5, 12.0), mode="wrap")
    return (streaks - streaks.mean()) / streaks.std()


def _twill() -> tuple[Array, Array, Array]:
    """Each pixel's upper tow: whether it is of the first direction, how far along its float it is, and across."""
    at = (np.arange(TWILL_PIXELS) + 0.5) / TWILL_PIXELS * TWILL_TOWS
    y, x = np.meshgrid(at, at, indexing="ij")
    phase = (np.floor(x) - np.floor(y)) % 4
    over = phase < 2
    along = np.where(over, ((np.floor(x) - y) % 4 + 1) % 4 / 2, ((x - np.floor(y) - 2) % 4) / 2)
    return over, np.clip(along, 0, 1), np.where(over, x, y) % 1


def _centred(slopes: Array) -> Array:
    """The same slopes, none in the mean."""
    return np.asarray(slopes - slopes.mean(axis=(0, 1)))


def _normals(slopes: Array) -> Array:
    """Unit normals as colours: slopes (H, W, 2) are the surface's rise to the right and downwards."""
    # Rows run downwards, t upwards: the second slope changes its sign twice.
    normal = np.stack([-slopes[..., 0], slopes[..., 1], np.ones(slopes.shape[:2])], axis=-1)
    unit: Array = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return (unit + 1) / 2
