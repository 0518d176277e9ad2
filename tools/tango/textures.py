"""The textures of the reflective look: tileable, 8-bit, the same from run to run.

Images are (H, W, C) float64 in 0 to 1, the top row first; st (0, 0) is the lower left corner.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813  the name its own documentation uses
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import gaussian_filter
from scipy.spatial import Delaunay

from spin_usd.scene.derived import srgb
from tango import dimensions as d
from tango.shapes.shape import Array
from tango.wear import wear

FOIL_PIXELS = 448
BRUSHED_PIXELS = 128
CELL_PIXELS = (160, 80)  # half a millimetre each
SILICON = np.array([0.030, 0.042, 0.095])  # linear: blue-black, as an anti-reflection coating leaves it
SILVER = np.array([0.62, 0.62, 0.64])


def write_textures(folder: Path) -> None:
    """Every texture as a PNG into an existing folder."""
    for name, make in TEXTURES.items():
        _write(folder / name, make())


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


def solar_cell() -> Array:
    """An atlas of cells, each of its own shade, with fingers and bus bars; sRGB."""
    bars, fingers = _grid()
    rng, shape = np.random.default_rng(21), (d.CELL_TONES[1], d.CELL_TONES[0])
    tones = (0.55 + 0.9 * rng.random((*shape, 1))) * (0.85 + 0.3 * rng.random((*shape, 3)))
    shade = np.kron(tones, np.ones((CELL_PIXELS[1], CELL_PIXELS[0], 1))) * SILICON
    everywhere = np.tile(np.maximum(bars, 0.12 * fingers), d.CELL_TONES[::-1])[..., None]
    return srgb.encode(shade + everywhere * (SILVER - shade))


def solar_cell_metal() -> Array:
    """1 on the bus bars, 0 on the cell."""
    return np.tile(_grid()[0], d.CELL_TONES[::-1])[..., None]


TEXTURES: dict[str, Callable[[], Array]] = {
    "foil_normal.png": foil_normal,
    "brushed_roughness.png": brushed_roughness,
    "brushed_normal.png": brushed_normal,
    "wear.png": wear,
    "solar_cell.png": solar_cell,
    "solar_cell_metal.png": solar_cell_metal,
}


def _grid() -> tuple[Array, Array]:
    """One cell: two bus bars along s near its long edges, and fingers across, every 2 mm."""
    width, height = CELL_PIXELS
    rows, columns = np.arange(height), np.arange(width)
    bars = np.isin(rows, (7, 8, 9, height - 10, height - 9, height - 8))[:, None] * np.ones(width)
    fingers = np.ones(height)[:, None] * (columns % 4 == 1)
    return bars.astype(float), fingers.astype(float)


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


def _normals(slopes: Array) -> Array:
    """Unit normals as colours: slopes (H, W, 2) are the surface's rise to the right and downwards."""
    # Rows run downwards, t upwards: the second slope changes its sign twice.
    normal = np.stack([-slopes[..., 0], slopes[..., 1], np.ones(slopes.shape[:2])], axis=-1)
    unit: Array = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return (unit + 1) / 2


def _write(path: Path, image: Array) -> None:
    pixels = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.UINT8)
    spec.attribute("png:compressionLevel", 9)
    output = oiio.ImageOutput.create(str(path))
    if not output or not output.open(str(path), spec) or not output.write_image(pixels) or not output.close():
        raise OSError(f"{path} could not be written: {oiio.geterror()}")
