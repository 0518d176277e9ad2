"""Where the beams of a LiDAR go: patterns of unit directions in its own axes, x forward, y left, z up.

Angles are degrees. Azimuth turns from forward to the left, elevation upwards. Sines and cosines are Python's own: the
last bits of numpy's depend on the processor.
"""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from spin_usd.arrays import Float, frozen

Span = tuple[float, float]
GOLDEN = (math.sqrt(5) - 1) / 2  # turns of a rosette's second prism for one of its first: the pattern never closes


def raster(rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the directions (rows x columns, 3) to a focal plane's pixels, row by row from the top left, as a flash
    LiDAR has them: the spans are those of the whole plane, and each beam goes to the middle of its pixel."""
    left, right = (math.tan(math.radians(angle)) for angle in reversed(azimuth))
    top, bottom = (math.tan(math.radians(angle)) for angle in reversed(elevation))
    y = left + (np.arange(columns) + 0.5) * ((right - left) / columns)
    z = top + (np.arange(rows) + 0.5) * ((bottom - top) / rows)
    return _unit(np.ones(1), np.tile(y, rows), np.repeat(z, columns))


def spinning(rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the directions (rows x columns, 3) of so many rings, the highest first, with so many equal steps of each,
    from the left to the right: clockwise as seen from above. The elevations are those of the highest and the lowest
    ring; the azimuths are where the steps begin and end, and each beam goes to the middle of its step."""
    step = (azimuth[1] - azimuth[0]) / columns
    turns = [math.radians(azimuth[1] - (i + 0.5) * step) for i in range(columns)]
    low, high = elevation
    rise = (high - low) / max(rows - 1, 1)
    rings = [math.radians(high - i * rise if rows > 1 else (high + low) / 2) for i in range(rows)]
    along, across = np.array([math.cos(a) for a in turns]), np.array([math.sin(a) for a in turns])
    level, up = np.array([math.cos(a) for a in rings]), np.array([math.sin(a) for a in rings])
    return _unit(np.outer(level, along).ravel(), np.outer(level, across).ravel(), np.repeat(up, columns))


def rosette(rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the directions (rows x columns, 3), in time, of a beam that two turning prisms bend: so many turns of the
    first, with so many beams each. The spans are those of the rosette, whose leaves fill it evenly with time."""
    first = [2 * math.pi * ((i + 0.5) / columns % 1) for i in range(columns)]
    second = [-2 * math.pi * (GOLDEN * (i + 0.5) / columns % 1) for i in range(rows * columns)]
    u = (np.tile([math.cos(a) for a in first], rows) + [math.cos(a) for a in second]) / 2
    v = (np.tile([math.sin(a) for a in first], rows) + [math.sin(a) for a in second]) / 2
    left, right = (math.tan(math.radians(angle)) for angle in reversed(azimuth))
    top, bottom = (math.tan(math.radians(angle)) for angle in reversed(elevation))
    return _unit(np.ones(1), (left + right) / 2 + u * (left - right) / 2, (top + bottom) / 2 + v * (top - bottom) / 2)


PATTERNS: Mapping[str, Callable[[int, int, Span, Span], Float]] = {
    "raster": raster,
    "spinning": spinning,
    "rosette": rosette,
}
"""The patterns that there are. A new one is a function of these arguments and an entry here."""
FLAT = ("raster", "rosette")
"""Those that lie on a plane before the LiDAR, so that their angles are below 90 degrees."""


@lru_cache(maxsize=4)
def beam_directions(pattern: str, rows: int, columns: int, azimuth: Span, elevation: Span) -> Float:
    """Return the read-only directions (rows x columns, 3) of the pattern of that name."""
    return frozen(PATTERNS[pattern](rows, columns, azimuth, elevation))


def _unit(x: Float, y: Float, z: Float) -> Float:
    length = np.sqrt(x * x + y * y + z * z)
    return np.stack([x / length, y / length, z / length], -1)
