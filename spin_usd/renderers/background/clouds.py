"""A planet's clouds: what they cover, how bright they are, and the shadows that they cast; and thin ones far above."""

from dataclasses import dataclass

import numpy as np

from spin_usd.renderers.background.elementary import Float32, exp, log
from spin_usd.renderers.background.enlarge import enlarged
from spin_usd.renderers.background.node_grid import NodeGrid
from spin_usd.renderers.background.noise_octaves import octave, resolved
from spin_usd.renderers.background.planet_maps import ramp
from spin_usd.renderers.background.weather import Weather

SHARPNESS = 0.5  # width of a cloud's edge, in standard deviations of its thickness
LOGISTIC = 1.702  # a logistic function so much steeper is the normal distribution, to 0.01
MIN_OPACITY = 0.002
CLOUD_HEIGHT, SHADE_HEIGHT = 0.28, 0.25  # of a unit of noise, in scale heights of the air
MAX_AHEAD = np.float32(1.2)  # units of noise by which it changes at most on the way to a shadow
SHADE = np.float32(0.6)  # of the light that a cloud's shadow takes
CONTRAST = np.float32(0.6)
"""By so much a steep slope that faces the Sun is brighter than level ground, and one behind it darker."""
CLOSE = 6.0  # of the longest wave, below which pixels must be for any of them: one octave alone is a pattern of dots
VEIL_WAVES = (0.025, 0.0015)  # the longest and the shortest of the fibres of high clouds, radians
VEIL_STRETCH, VEIL_GAIN, VEIL_OPACITY = 4.0, 0.7, np.float32(0.25)
VEIL_NUMBER = 20  # of their first octave: how the tile of noise lies


@dataclass(frozen=True, kw_only=True, eq=False)
class Clouds:
    """Clouds at pixels of any shape. opacity · logit: the logarithm of opacity over clearness, for how thick they are ·
    odds: clearness over opacity · firmness: how much of the logit a unit of noise is · white: R, G, B of the thickest.
    """

    opacity: Float32
    logit: Float32
    odds: Float32
    firmness: Float32
    white: tuple[float, ...]

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
    """Return the firmness of clouds of noise of which so much variance is resolved; the rest makes edges softer."""
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
