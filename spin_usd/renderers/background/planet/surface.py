"""A planet's surface at each pixel of a block: ground, sea and clouds, in the light of each Sun."""

from dataclasses import dataclass

import numpy as np

from spin_usd.renderers.background.arithmetic.elementary import Float32, exp

SHARPNESS = 0.5  # width of a cloud's edge, in standard deviations of its thickness
LOGISTIC = 1.702  # a logistic function so much steeper is the normal distribution, to 0.01
CLOUD_HEIGHT, GROUND_HEIGHT, SHADE_HEIGHT = 0.28, 0.1, 0.25  # of a unit of noise, in scale heights of the air
CONTRAST = np.float32(
    0.6
)  # by which a steep slope that faces the Sun is brighter than level ground, and one behind it darker
SHADE = 0.6  # of the light that a cloud's shadow takes
ROUGH_GROUND, ROUGH_SEA = 0.18, 0.2  # standard deviation of albedo and of glint, relative
VEIL_ALBEDO = np.float32(0.75)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetSurface:
    """The surface of a block of pixels (H, W).

    ground: R, G, B of its albedo · water, veil: shares, the veil that of thin high clouds · opacity: of clouds · thick:
    the logit of that · white: R, G, B of the thickest · noise: detail, of variance 1 at most · edge: how much of it a
    cloud's edge is wide · ranges: how high it is on land · slopes: for each Sun, how fast the clouds rise toward it per
    radian, times the tangent of its zenith angle · height: the air's scale height in planet radii.
    """

    ground: list[Float32]
    water: Float32
    opacity: Float32
    thick: Float32
    veil: Float32 | None
    white: tuple[float, ...]
    noise: Float32
    edge: Float32
    ranges: Float32
    slopes: list[Float32]
    height: np.float32

    def albedo(self, sun: int) -> list[Float32]:
        """Return R, G, B of the albedo in the light of the Sun of that number: slopes that face it are brighter, and
        beside a cloud lies its shadow."""
        cloud, ground = self._clouds(sun), self._relief(sun)
        found: list[Float32] = [
            g * ground + cloud * np.float32(w) for g, w in zip(self.ground, self.white, strict=True)
        ]
        if self.veil is None:
            return found
        return [channel + self.veil * (VEIL_ALBEDO - channel) for channel in found]

    def glossy(self, sun: int) -> Float32:
        """Return the share of the pixel that is sea in the light of that Sun, rougher and smoother with the wind."""
        sea = self.water * self.clear * self._lit(sun)
        return np.asarray(sea * (1 + np.float32(ROUGH_SEA) * self.noise))

    @property
    def clear(self) -> Float32:
        """The share of light that clouds let through."""
        clear = 1 - self.opacity
        return clear if self.veil is None else np.asarray(clear * (1 - self.veil))

    def _clouds(self, sun: int) -> Float32:
        """Return their opacity, times how bright they are: the thicker, the brighter, and the more relief they show; in
        thin ones light is scattered to all sides."""
        inside = np.maximum(self.thick, 0)
        dense = inside / (inside + np.float32(3))
        relief = _shaded(self.slopes[sun] * (self.height * np.float32(-CLOUD_HEIGHT))) * dense
        return np.asarray(self.opacity * (np.float32(0.42) + np.float32(0.95) * dense) * (1 + relief))

    def _relief(self, sun: int) -> Float32:
        """Return how bright the ground is below the clouds, over level ground in full light."""
        land = 1 - self.water
        slopes = self.slopes[sun] * (self.height * np.float32(-GROUND_HEIGHT)) * self.ranges
        relief = 1 + _shaded(slopes * land)
        relief *= 1 + np.float32(ROUGH_GROUND) * self.noise * land
        return np.asarray(relief * (1 - self.opacity) * self._lit(sun))

    def _lit(self, sun: int) -> Float32:
        """Return the share of the Sun's light on the ground: a cloud a little way toward it takes the rest."""
        ahead = np.clip(self.slopes[sun] * (self.height * np.float32(SHADE_HEIGHT)), -1.2, 1.2)
        hidden = 1 / (1 + exp(-self.thick - ahead * np.float32(LOGISTIC) / self.edge))
        return np.asarray(1 - np.float32(SHADE) * hidden)


def _shaded(slope: Float32) -> Float32:
    """Return by how much a slope toward the Sun is brighter than level ground; the steepest can do no more."""
    return np.asarray(np.float32(CONTRAST) * slope / np.sqrt(1 + slope * slope))
