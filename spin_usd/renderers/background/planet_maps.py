"""A planet's maps as tables: each level has half of the texels of the one before, so that pixels look up their own."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spin_usd.renderers.background.dome import bilinear_latlong
from spin_usd.renderers.background.elementary import Float32, arctan2
from spin_usd.renderers.background.enlarge import repeated
from spin_usd.scene.texture import Image

LEVELS = 10
WIDE_LEVEL = 3  # whose texels are so wide that they hold land beyond any coast
BLUE = (0.02, 0.08)  # by how much of its colour water is bluer than green or red
DARK = (0.2, 0.4)  # the blue above which it is ice, not water
Slices = tuple[slice, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Places:
    """Longitude and latitude of points, and the base-2 logarithm of their footprints in radians."""

    longitude: Float32
    latitude: Float32
    size: Float32

    @classmethod
    def of(cls, normal: Sequence[Float32], footprint: Float32) -> "Places":
        """Return the places of the unit vectors x, y, z in planet axes, or of others of their directions."""
        x, y, z = normal
        latitude = arctan2(z, np.sqrt(x * x + y * y))
        return cls(longitude=arctan2(y, x), latitude=latitude, size=_size(footprint))


@dataclass(frozen=True, kw_only=True, eq=False)
class Map:
    """Levels of tables (C, H + 1, W + 1), repeated."""

    levels: tuple[Float32, ...]
    texel: float
    """The width of the first's texels, radians."""

    @classmethod
    def of(cls, tables: Float32) -> "Map":
        """Make all levels of the tables (C, H, W)."""
        levels, texel = [repeated(tables)], 2 * np.pi / tables.shape[2]
        while len(levels) < LEVELS and tables.shape[1] % 2 == 0 and tables.shape[2] % 2 == 0 and tables.shape[1] > 8:
            tables = tables[:, ::2] + tables[:, 1::2]
            tables = (tables[:, :, ::2] + tables[:, :, 1::2]) * np.float32(0.25)
            levels.append(repeated(tables))
        return cls(levels=tuple(levels), texel=texel)

    def at(self, places: Places) -> list[Float32]:
        """Return each channel at `places`, of the levels whose texels are as wide as the pixels."""
        level = np.clip(places.size - _size(np.float32(self.texel)), 0, len(self.levels) - 1)
        first, last = int(level.min()), int(-(-float(level.max()) // 1))
        if first == last:
            return bilinear_latlong(self.levels[first], places.longitude, places.latitude)
        total = [np.zeros(level.size, np.float32) for _ in self.levels[0]]
        longitude, latitude = places.longitude.ravel(), places.latitude.ravel()
        for index in range(first, last + 1):
            share = np.maximum(1 - np.abs(level.ravel() - np.float32(index)), 0)
            at = np.flatnonzero(share)
            share = share[at]
            found = bilinear_latlong(self.levels[index], longitude[at], latitude[at])
            for channel, values in zip(total, found, strict=True):
                channel[at] += values * share
        return [channel.reshape(level.shape) for channel in total]


@lru_cache(maxsize=4)
def ground_map(albedo: Image) -> Map:
    """Return R, G, B of the albedo and the share of water."""
    colour = np.ascontiguousarray(np.moveaxis(albedo.pixels[..., :3], -1, 0))
    return Map.of(np.concatenate([colour, _water(colour)[None]]))


@lru_cache(maxsize=4)
def cloud_map(clouds: Image) -> Map:
    """Return the opacity."""
    return Map.of(np.ascontiguousarray(clouds.pixels[None, ..., 3]))


@lru_cache(maxsize=4)
def night_map(night: Image) -> Map:
    """Return R, G, B of the lights; 1 is the brightest."""
    return Map.of(np.ascontiguousarray(np.moveaxis(night.pixels[..., :3], -1, 0)))


@lru_cache(maxsize=4)
def shores(albedo: Image) -> Map:
    """Return R, G, B of water minus land, both from the neighbourhood: the change of a texel of land that becomes
    water."""
    whole = ground_map(albedo)
    tables = whole.levels[min(WIDE_LEVEL, len(whole.levels) - 1)][:, :-1, :-1]
    water, land = tables[3], 1 - tables[3]
    sea, ground = (_spread(tables[:3] * share, share) for share in (water * water, land * land))
    return Map.of(sea - ground)


def _size(lengths: Float32 | np.float32) -> Float32:
    """Return their base-2 logarithm, along a line between powers of two: it only says which of two levels is nearer."""
    bits = np.maximum(lengths, np.float32(1e-12)).view(np.int32)
    return np.asarray(bits.astype(np.float32) * np.float32(2**-23) - np.float32(127), np.float32)


def _water(colour: Float32) -> Float32:
    """Return the share of water (H, W) from the colour (3, H, W): blue and dark texels."""
    red, green, blue = colour
    bluer = (blue - np.maximum(red, green)) / np.maximum(red + green + blue, np.float32(1e-4))
    return np.asarray(ramp(bluer, *BLUE) * (1 - ramp(blue, *DARK)), np.float32)


def _spread(colour: Float32, share: Float32) -> Float32:
    """Return the mean of the colours (3, H, W), of as many texels around as have a share (H, W) of them."""
    weight = share + np.float32(1e-6)
    total = colour + np.float32(1e-6) * np.float32(0.1)
    for _ in range(4):
        blurred, less = _blurred(total), _blurred(weight[None])[0]
        total, weight = total + blurred * np.float32(0.05), weight + less * np.float32(0.05)
    return total / weight


def _blurred(tables: Float32) -> Float32:
    wide = np.roll(tables, 1, 2) + tables + np.roll(tables, -1, 2)
    padded = np.concatenate([wide[:, :1], wide, wide[:, -1:]], axis=1)
    return np.asarray((padded[:, :-2] + padded[:, 1:-1] + padded[:, 2:]) * np.float32(1 / 9))


def ramp(values: Float32, low: float, high: float) -> Float32:
    """Return 0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((values - np.float32(low)) * np.float32(1 / (high - low)), 0, 1)
    return np.asarray(t * t * (3 - 2 * t))
