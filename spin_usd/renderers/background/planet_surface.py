"""A planet's surface at each pixel of a block: ground, sea and clouds, in the light of each Sun."""

from dataclasses import dataclass

import numpy as np

from spin_usd.renderers.background.elementary import Float32, exp, log
from spin_usd.renderers.background.enlarge import enlarged
from spin_usd.renderers.background.node_grid import NodeGrid
from spin_usd.renderers.background.noise_octaves import octave, resolved
from spin_usd.renderers.background.planet_maps import ramp
from spin_usd.renderers.background.weather import Weather

GROUND_HEIGHT = 0.1  # of a unit of noise, in scale heights of the air
ROUGH_GROUND, ROUGH_SEA = np.float32(0.18), np.float32(0.2)  # standard deviation of albedo and of glint, relative
VEIL_ALBEDO = np.float32(0.75)
SHARPNESS = 0.5  # width of a cloud's edge, in standard deviations of its thickness
LOGISTIC = 1.702  # a logistic function so much steeper is the normal distribution, to 0.01
MIN_OPACITY = 0.002
CLOUD_HEIGHT, SHADE_HEIGHT = 0.28, 0.25  # of a unit of noise, in scale heights of the air
MAX_AHEAD = np.float32(1.2)  # units of noise by which it changes at most on the way to a shadow
SHADE = np.float32(0.75)  # of the direct light that a cloud's shadow takes
CONTRAST = np.float32(0.6)
"""How much brighter than level ground a steep slope is that faces the Sun, and how much darker one behind it."""
CLOSE = 6.0  # of the longest wave, below which pixels must be for any of them: one octave alone is a pattern of dots
VEIL_WAVES = (0.025, 0.0015)  # the longest and the shortest of the fibres of high clouds, radians
VEIL_STRETCH, VEIL_GAIN, VEIL_OPACITY = 4.0, 0.7, np.float32(0.25)
VEIL_NUMBER = 20  # of their first octave: how the tile of noise lies


@dataclass(frozen=True, kw_only=True, eq=False)
class Clouds:
    """Clouds at pixels of any shape."""

    opacity: Float32
    logit: Float32
    """The logarithm of opacity over clearness, for how thick they are."""
    odds: Float32
    """Clearness over opacity."""
    firmness: Float32
    """How much of the logit a unit of noise is."""
    white: tuple[float, ...]
    """R, G, B of the thickest."""

    @classmethod
    def of(cls, noise: Float32, threshold: Float32, firmness: Float32, white: tuple[float, ...]) -> "Clouds":
        """Return the clouds that are where `noise` plus `threshold` is above 0."""
        logit = noise + threshold
        logit *= firmness
        odds = exp(-logit)
        opacity = np.asarray(1 / (1 + odds), np.float32)
        return cls(opacity=opacity, logit=logit, odds=odds, firmness=firmness, white=white)

    def brightness(self, rise: Float32 | None) -> Float32:
        """Return the opacity, times how bright the clouds are: the thicker, the brighter, and the more relief they
        show; in thin ones light is scattered to all sides. `rise`: as in a PlanetSurface."""
        dense = np.maximum(self.logit, 0)
        dense /= dense + np.float32(3)
        bright = np.float32(0.42) + np.float32(0.95) * dense
        if rise is not None:
            dense *= shaded(rise * np.float32(-CLOUD_HEIGHT))
            dense += 1
            bright *= dense
        bright *= self.opacity
        return bright

    def sunlit(self, rise: Float32 | None) -> Float32:
        """Return the share of the Sun's light on the ground: a cloud a little way toward it takes the rest. `rise`: as
        in a PlanetSurface."""
        if rise is None:
            return np.asarray(1 - SHADE * self.opacity)
        ahead = np.clip(rise * np.float32(SHADE_HEIGHT), -MAX_AHEAD, MAX_AHEAD)
        ahead *= self.firmness
        # e to the power of what is between -4 and 4, near enough for a shadow.
        power = 1 - ahead * np.float32(1 / 16)
        for _ in range(4):
            power *= power
        power *= self.odds
        power += 1
        return np.asarray(1 - SHADE / power)


def threshold_of(cover: Float32) -> Float32:
    """Return what is added to noise so that clouds, where the sum is above 0, have `cover` of the area.

    Noise is normally distributed, and a cloud's edge is SHARPNESS of its standard deviations wide.
    """
    within = np.clip(cover, MIN_OPACITY, 1 - MIN_OPACITY)
    return log(within / (1 - within)) * np.float32(np.sqrt(1 + SHARPNESS**2) / LOGISTIC)


def firmness_of(variance: Float32) -> Float32:
    """Return the firmness of clouds whose noise is resolved to that variance; the rest makes edges softer."""
    return np.asarray(np.float32(LOGISTIC) / np.sqrt(np.float32(1 + SHARPNESS**2) - variance), np.float32)


def veil_opacity(nodes: NodeGrid, weather: Weather) -> Float32 | None:
    """Return the opacity of thin high clouds at the pixels; None where there are none."""
    coarsest, finest = VEIL_WAVES
    close = resolved(nodes.points.meeting.footprint, coarsest / CLOSE)
    if float(weather.veil.max()) < -1 or not close.any():
        return None
    total, stride = weather.veil, nodes.spacing
    for found in nodes.octaves(coarsest, VEIL_GAIN, finest):
        (total,), stride = enlarged([total], stride // found.stride), found.stride
        (amplitude,) = nodes.enlarged([found.amplitude * np.float32(0.6)], to=stride)
        number, finer = VEIL_NUMBER + found.number, nodes.spacing // stride
        total = total + amplitude * octave(nodes.points.faces, found.wave, number, VEIL_STRETCH, finer)
    (close,) = nodes.enlarged([close], to=stride)
    return enlarged([ramp(total, 0.4, 2.6) * close * VEIL_OPACITY], stride)[0]


def shaded(slope: Float32) -> Float32:
    """Return by how much a slope toward the Sun is brighter than level ground; the steepest can do no more."""
    size = slope * slope
    size += 1
    return np.asarray(CONTRAST * slope / np.sqrt(size, out=size))


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetSurface:
    """The surface at pixels of any shape."""

    ground: list[Float32]
    """R, G, B of its albedo."""
    water: Float32
    """Its share."""
    noise: Float32
    """Detail, of variance 1 at most."""
    ranges: Float32
    """How high it is on land."""
    rises: list[Float32 | None]
    """How much it rises toward each Sun over a scale height of the air, times the tangent of the Sun's zenith angle;
    None for not at all."""
    clouds: Clouds | None
    veil: Float32 | None
    """The opacity of thin high clouds; None without."""

    def sunlit(self, sun: int) -> Float32:
        """Return the share of light of the Sun of that number on the ground, past clouds in between."""
        return np.ones_like(self.water) if self.clouds is None else self.clouds.sunlit(self.rises[sun])

    def albedo(self, sun: int, sunlit: Float32, skylight: list[Float32] | None) -> list[Float32]:
        """Return R, G, B of the albedo in the light of a Sun that is `sunlit` on the ground: slopes that face it are
        brighter. `skylight`: its share of the light, which shadows and slopes do not change; None without air."""
        relief = self._relief(sun)
        relief *= sunlit
        if self.clouds:
            relief *= 1 - self.clouds.opacity
        if skylight is None:
            found: list[Float32] = [ground * relief for ground in self.ground]
        else:
            level = 1 - relief if self.clouds is None else 1 - self.clouds.opacity - relief
            found = [ground * (relief + level * share) for ground, share in zip(self.ground, skylight, strict=True)]
        if self.clouds:
            bright = self.clouds.brightness(self.rises[sun])
            for channel, white in zip(found, self.clouds.white, strict=True):
                channel += bright * np.float32(white)
        if self.veil is not None:
            for channel in found:
                channel += self.veil * (VEIL_ALBEDO - channel)
        return found

    def glossy(self, sunlit: Float32) -> Float32:
        """Return the share of the pixel that is sea in the Sun, rougher and smoother with the wind."""
        return np.asarray(self.water * self.clear * sunlit * (1 + ROUGH_SEA * self.noise))

    @property
    def clear(self) -> Float32:
        """The share of light that clouds let through."""
        clear = np.ones_like(self.water) if self.clouds is None else 1 - self.clouds.opacity
        return clear if self.veil is None else np.asarray(clear * (1 - self.veil))

    def _relief(self, sun: int) -> Float32:
        """Return how bright the ground is, over level ground."""
        land, rise = 1 - self.water, self.rises[sun]
        relief = np.asarray(1 + ROUGH_GROUND * self.noise * land)
        if rise is not None:
            relief *= 1 + shaded(rise * self.ranges * land * np.float32(-GROUND_HEIGHT))
        return relief
