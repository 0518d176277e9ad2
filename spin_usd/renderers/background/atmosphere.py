"""Light that a planet's air scatters once: an exponential atmosphere, Rayleigh's law, a curved surface.

A ray's way through the air counts in vertical thicknesses, its air mass: 1 / cos(zenith angle) where the ground is flat
enough, and sqrt(pi R / 2H) along the horizon (S. Chapman, 1931); between them 1 / sqrt(cos^2 + 2H / pi R).
"""

from dataclasses import dataclass

import numpy as np

from spin_usd.renderers.background.elementary import Float32, exp


@dataclass(frozen=True, kw_only=True, eq=False)
class Air:
    """Air that grows thinner with height. scale_height: in planet radii; depth: the optical depth straight down, R, G,
    B."""

    scale_height: float
    depth: tuple[float, float, float]

    def mass(self, cosine: Float32) -> Float32:
        """Return (N,) air mass from the surface to space, at the `cosine` of the zenith angle, 0 for one below the
        horizon."""
        bent = np.float32(2 * self.scale_height / np.pi)
        return np.asarray(1 / np.sqrt(np.square(np.maximum(cosine, 0)) + bent))

    @property
    def limb_mass(self) -> float:
        """The air mass of a ray from space to space along the horizon."""
        return float(np.sqrt(2 * np.pi / self.scale_height))

    def thinned(self, height: Float32) -> Float32:
        """Return (N,) density at `height` in planet radii, over that at the surface."""
        return exp(height * np.float32(-1 / self.scale_height))

    def twilight(self, cosine: Float32) -> Float32:
        """Return (N,) share of the air that the Sun still reaches where it stands below the horizon by -`cosine`
        radians: the share above the planet's shadow."""
        return exp(np.square(np.minimum(cosine, 0)) * np.float32(-0.5 / self.scale_height))


def rayleigh(cosine: Float32) -> Float32:
    """Phase function over 4 pi, 1/sr, of the angle between the light's way before and after."""
    return (1 + cosine * cosine) * np.float32(3 / (16 * np.pi))
