"""The light of one Sun at points of a planet: light that reaches ground and sea, and light scattered by the air."""

from dataclasses import dataclass, replace

import numpy as np

from spin_usd.basics.arrays import Float
from spin_usd.renderers.background.elementary import Float32, exp, rotated
from spin_usd.renderers.background.globe import MIN_MASS, Air, Globe, Meeting, Rays, rayleigh
from spin_usd.scene.environment import Planet
from spin_usd.scene.light import DistantLight, Light

RGB = range(3)
# Of the slopes of a sea that wind of 7 m/s roughens: 0.003 + 0.00512 times that (C. Cox and W. Munk, 1954).
SLOPE_VARIANCE = 0.003 + 0.00512 * 7.0
NORMAL_REFLECTANCE = 0.02  # of water, refractive index 1.33, seen straight
LEAST_COSINE = np.float32(0.08)  # below it waves hide one another, which the formula does not know
NO_GLINT = np.float32(1e-4)  # 1/sr


@dataclass(frozen=True, kw_only=True, eq=False)
class SunAtPoints:
    """Light at points of any shape: R, G, B, W/m2/sr."""

    cosine: Float32
    """Cosine of the Sun's zenith angle."""
    ground: list[Float32]
    """Light of white ground that faces the Sun, without light reflected between ground and air."""
    skylight: list[Float32]
    """The share of `ground` that arrived scattered."""
    air: list[Float32]
    """Light of the air in front of it."""
    glint: list[Float32]
    """Light of a sea."""
    direction: Float
    """(3,) to the Sun, planet axes."""
    half: np.float32
    """The Sun's angular radius."""

    def lit(self, cosine: Float32) -> Float32:
        """Return the irradiance at the `cosine` of a zenith angle over that of ground that faces the Sun; near the
        horizon only a part of its disc is up, reckoned as a band as high as the disc."""
        if cosine.min(initial=1) > self.half:
            return cosine
        risen = np.clip(cosine + self.half, 0, 2 * self.half)
        return np.asarray(np.where(cosine > self.half, cosine, risen * risen / (4 * self.half)))


def suns_of_planets(lights: tuple[Light, ...]) -> tuple[DistantLight, ...]:
    """Return the lights that light a planet."""
    return tuple(
        light for light in lights if isinstance(light, DistantLight) and light.lights is None and any(light.irradiance)
    )


def transmittances(air: Air | None, meeting: Meeting) -> list[Float32]:
    """Return the share of light, R, G, B, that the air in front of the points lets through."""
    if air is None:
        return [np.ones_like(meeting.covered)] * 3
    return [exp(_mass(air, meeting) * np.float32(-air.depth[c])) for c in RGB]


def sunlight(globe: Globe, sun: DistantLight, rays: Rays, meeting: Meeting, through: list[Float32]) -> SunAtPoints:
    """Return the light of `sun`: what the ground sends back of direct light and skylight, and what the air scatters
    itself: of parallel layers, once, E P m / (m + m_sun) (1 - exp(-t (m + m_sun))), with the air masses m, and more
    often in proportion."""
    air, direction = globe.air, _direction(globe.planet, sun)
    n = meeting.normal
    cosine = (n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2]).astype(np.float32)
    between = _scattering_cosine(sun, rays)
    glint = glint_of(cosine, meeting.toward, between)
    found = SunAtPoints(
        cosine=cosine,
        ground=[np.full_like(cosine, sun.irradiance[c] / np.pi) for c in RGB],
        skylight=[np.zeros_like(cosine)] * 3,
        air=[np.zeros_like(cosine)] * 3,
        glint=[np.float32(sun.irradiance[c]) * through[c] * glint for c in RGB],
        direction=direction,
        half=np.float32(max(sun.angle / 2, 1e-6)),
    )
    return found if air is None else _in_air(found, air, meeting, through, rayleigh(between))


def _in_air(bare: SunAtPoints, air: Air, meeting: Meeting, through: list[Float32], phase: Float32) -> SunAtPoints:
    """Return the light of `bare`, of a planet without air, under `air`."""
    mass, sun_mass = _mass(air, meeting), air.thinned(meeting.height) * air.mass(bare.cosine)
    clear = [exp(sun_mass * np.float32(-air.depth[c])) for c in RGB]
    scattered = phase * air.twilight(bare.cosine) * (mass / np.maximum(mass + sun_mass, MIN_MASS))
    down = [air.passed(sun_mass, clear[c], c) for c in RGB]
    return replace(
        bare,
        ground=[bare.ground[c] * down[c] * air.passed(mass, through[c], c) for c in RGB],
        skylight=[1 - clear[c] / down[c] for c in RGB],
        air=[
            bare.ground[c] * np.float32(np.pi) * air.multiple_scattering[c] * scattered * (1 - through[c] * clear[c])
            for c in RGB
        ],
        glint=[bare.glint[c] * clear[c] for c in RGB],
    )


def glint_of(sun: Float32, eye: Float32, between: Float32) -> Float32:
    """Return the radiance of a sea over the irradiance of a surface that faces the Sun, 1/sr.

    sun, eye: cosines of their zenith angles; between: cosine of the angle by which light is turned. A wave that mirrors
    the Sun is tilted to half way between both directions. Source: Cox and Munk, with Schlick's reflectance.
    """
    half = np.maximum((1 - between) * np.float32(0.5), np.float32(1e-6))  # squared cosine of the angle of incidence
    upright = np.maximum(sun + eye, 0)
    tilt = np.maximum(upright * upright / (4 * half), np.float32(1e-3))  # squared cosine of the wave's slope
    slopes = exp((1 - 1 / tilt) * np.float32(1 / SLOPE_VARIANCE)) * np.float32(1 / (np.pi * SLOPE_VARIANCE))
    graze = 1 - np.sqrt(np.minimum(half, 1))
    square = graze * graze
    mirrored = np.float32(NORMAL_REFLECTANCE) + np.float32(1 - NORMAL_REFLECTANCE) * square * square * graze
    found = mirrored * slopes / (4 * np.maximum(eye, LEAST_COSINE) * tilt * tilt)
    return np.asarray(np.where((sun > 0) & (found > NO_GLINT), found, 0), np.float32)


def _mass(air: Air, meeting: Meeting) -> Float32:
    covered = meeting.covered
    to_ground = covered * air.mass(meeting.toward)
    return np.asarray(air.thinned(meeting.height) * (to_ground + (1 - covered) * np.float32(air.limb_mass)))


def _direction(planet: Planet, sun: DistantLight) -> Float:
    """Return the direction (3,) to the Sun in the planet's axes."""
    return np.array(rotated(planet.T_cam_planet.rotation.T, [-way for way in sun.direction_cam]))


def _scattering_cosine(sun: DistantLight, rays: Rays) -> Float32:
    x, y, z = sun.direction_cam
    return np.asarray((rays.x * -x + rays.y * -y + rays.z * -z).astype(np.float32) / rays.length)
