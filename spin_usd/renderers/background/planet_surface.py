"""A planet's surface at each pixel of a block: ground, sea and clouds, in the light of each Sun."""

from dataclasses import dataclass

import numpy as np

from spin_usd.renderers.background.clouds import Clouds, shaded
from spin_usd.renderers.background.elementary import Float32

GROUND_HEIGHT = 0.1  # of a unit of noise, in scale heights of the air
ROUGH_GROUND, ROUGH_SEA = np.float32(0.18), np.float32(0.2)  # standard deviation of albedo and of glint, relative
VEIL_ALBEDO = np.float32(0.75)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetSurface:
    """The surface at pixels of any shape.

    ground: R, G, B of its albedo · water: its share · noise: detail, of variance 1 at most · ranges: how high it is on
    land · rises: for each Sun, how much it rises toward it over a scale height of the air, times the tangent of the
    Sun's zenith angle; None for not at all · veil: the opacity of thin high clouds, None without.
    """

    ground: list[Float32]
    water: Float32
    noise: Float32
    ranges: Float32
    rises: list[Float32 | None]
    clouds: Clouds | None
    veil: Float32 | None

    def sunlit(self, sun: int) -> Float32:
        """Return the share of light of the Sun of that number on the ground, past clouds in between."""
        return np.ones_like(self.water) if self.clouds is None else self.clouds.sunlit(self.rises[sun])

    def albedo(self, sun: int, sunlit: Float32) -> list[Float32]:
        """Return R, G, B of the albedo in the light of a Sun that is `sunlit` on the ground: slopes that face it are
        brighter."""
        relief = self._relief(sun)
        relief *= sunlit
        if self.clouds:
            relief *= 1 - self.clouds.opacity
        found: list[Float32] = [ground * relief for ground in self.ground]
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
