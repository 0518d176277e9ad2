"""The light of a planet along rays: from sunlit ground and clouds, and from the air before them."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from spin_usd.renderers.background.atmosphere import Air, rayleigh
from spin_usd.renderers.background.detail import detail
from spin_usd.renderers.background.globe import Globe, Meeting, Rays
from spin_usd.renderers.background.latlong import Float32, bilinear_latlong, planes
from spin_usd.scene.environment import Planet
from spin_usd.scene.light import DistantLight, Light
from spin_usd.scene.texture import Image

WAVE_TEXELS = 3.0  # the longest waves of detail, in texels of the images
RELIEF = 0.1  # standard deviation of the albedo by detail, relative
WARP_TEXELS = 0.7  # by which detail moves what the images show: coasts and edges get their shape from it
SHARPNESS = 0.7  # width of a cloud's edge, in standard deviations of its thickness
LOGISTIC = 1.702  # a logistic function so much steeper is the normal distribution, to 0.01
MIN_OPACITY = 0.002
MIN_MASS = np.float32(1e-20)
RGB = range(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetRadiance:
    """Light along N rays. radiance: R, G, B (N,), W/m2/sr, of planet and air · transmittance: R, G, B (N,), the share
    of what lies behind that they let through."""

    radiance: list[Float32]
    transmittance: list[Float32]


def suns_of_planets(lights: tuple[Light, ...]) -> tuple[DistantLight, ...]:
    """Return the lights that light a planet."""
    return tuple(
        light for light in lights if isinstance(light, DistantLight) and light.lights is None and any(light.irradiance)
    )


def planet_radiance(
    globe: Globe, suns: tuple[DistantLight, ...], rays: Rays, meeting: Meeting, *, fine: bool
) -> PlanetRadiance:
    """Return the light along the rays; `fine` adds detail finer than the planet's images."""
    planet, air = globe.planet, Air.of(globe.planet)
    albedo = _albedo(planet, meeting, fine)
    if air is None:
        sunlight = [np.zeros_like(meeting.covered) for _ in RGB]
        for sun in suns:
            lit = _lit(_cosine(planet, sun, meeting), sun.angle)
            for c in RGB:
                sunlight[c] += np.float32(sun.irradiance[c] / np.pi) * lit
        radiance = [meeting.covered * albedo[c] * sunlight[c] for c in RGB]
        return PlanetRadiance(radiance=radiance, transmittance=[1 - meeting.covered] * 3)
    return _through_air(air, planet, suns, rays, meeting, albedo)


def _through_air(
    air: Air,
    planet: Planet,
    suns: tuple[DistantLight, ...],
    rays: Rays,
    meeting: Meeting,
    albedo: list[Float32],
) -> PlanetRadiance:
    """Sunlight that the ground sends back, less what the air takes on both ways, and what the air scatters once itself:
    of parallel layers E P m / (m + m_sun) (1 - exp(-t (m + m_sun))), with the air masses m.

    Half of what the air takes from the sunlight reaches the ground as skylight.
    """
    density, covered = air.thinned(meeting.height), meeting.covered
    mass = density * (covered * air.mass(meeting.toward) + (1 - covered) * np.float32(air.limb_mass))
    transmittance = [np.exp(mass * np.float32(-air.depth[c])) for c in RGB]
    radiance = [np.zeros_like(covered) for _ in RGB]
    for sun in suns:
        cosine = _cosine(planet, sun, meeting)
        lit = _lit(cosine, sun.angle) * covered
        sun_mass = density * air.mass(cosine)
        scattered = (
            rayleigh(_scattering_cosine(sun, rays))
            * air.twilight(cosine)
            * (mass / np.maximum(mass + sun_mass, MIN_MASS))
        )
        for c in RGB:
            sun_clear = np.exp(sun_mass * np.float32(-air.depth[c]))
            ground = albedo[c] * lit * transmittance[c] * (1 + sun_clear) * np.float32(0.5 / np.pi)
            radiance[c] += np.float32(sun.irradiance[c]) * (ground + scattered * (1 - transmittance[c] * sun_clear))
    return PlanetRadiance(radiance=radiance, transmittance=[(1 - covered) * transmittance[c] for c in RGB])


def _cosine(planet: Planet, sun: DistantLight, meeting: Meeting) -> Float32:
    """Return (N,) cosine of the Sun's zenith angle."""
    s = planet.T_cam_planet.rotation.T @ -np.array(sun.direction_cam)
    n = meeting.normal
    return np.asarray(n[0] * np.float32(s[0]) + n[1] * np.float32(s[1]) + n[2] * np.float32(s[2]))


def _lit(cosine: Float32, angle: float) -> Float32:
    """Return (N,) irradiance over that of ground that faces the Sun; near the horizon only a part of its disc is up,
    reckoned as a band as high as the disc."""
    half = np.float32(max(angle / 2, 1e-6))
    risen = np.square(np.clip(cosine + half, 0, 2 * half)) / (4 * half)
    return np.asarray(np.where(cosine > half, cosine, risen))


def _scattering_cosine(sun: DistantLight, rays: Rays) -> Float32:
    x, y, z = sun.direction_cam
    return np.asarray((rays.x * -x + rays.y * -y + rays.z * -z).astype(np.float32) / rays.length)


def _albedo(planet: Planet, meeting: Meeting, fine: bool) -> list[Float32]:
    """R, G, B (N,) of ground and clouds together."""
    images = [image for image in (planet.albedo, planet.clouds) if isinstance(image, Image)]
    if not images:
        return [np.full_like(meeting.covered, channel) for channel in planet.albedo]  # type: ignore[union-attr]
    x, y, z = meeting.normal
    longitude = np.arctan2(y, x)
    latitude = np.arctan2(z, np.sqrt(x * x + y * y))
    texel = 2 * np.pi / max(image.pixels.shape[1] for image in images)
    noise = resolved = np.zeros_like(longitude)
    if fine:
        noise, resolved = detail(meeting.normal, meeting.footprint, WAVE_TEXELS * texel)
        warp = noise * np.float32(WARP_TEXELS * texel)
        latitude = latitude + warp
        longitude = longitude + warp / np.maximum(np.sqrt(x * x + y * y), np.float32(0.05))
    ground: list[Float32]
    if isinstance(planet.albedo, Image):
        ground = bilinear_latlong(planes(planet.albedo)[:3], longitude, latitude)
    else:
        ground = [np.full_like(noise, channel) for channel in planet.albedo]
    relief = 1 + np.float32(RELIEF) * noise
    if planet.clouds is None:
        return [channel * relief for channel in ground]
    logit, *white = bilinear_latlong(_cloud_tables(planet.clouds), longitude, latitude)
    opacity = _opacity(logit, noise, resolved)
    albedo = white or list(planet.clouds.pixels[0, 0, :3])
    return [(g + opacity * (w - g)) * relief for g, w in zip(ground, albedo, strict=True)]


@lru_cache(maxsize=4)
def _cloud_tables(clouds: Image) -> Float32:
    """Return the logit of the opacity, and R, G and B of the albedo where it varies: (1 or 4, H + 1, W + 1)."""
    red, green, blue, opacity = planes(clouds)
    within = np.clip(opacity, MIN_OPACITY, 1 - MIN_OPACITY)
    logit = np.log(within / (1 - within))
    varies = any(np.ptp(channel) for channel in (red, green, blue))
    return np.stack([logit, red, green, blue] if varies else [logit])


def _opacity(logit: Float32, noise: Float32, resolved: Float32) -> Float32:
    """Return (N,) of clouds that cover as much of a neighbourhood as their image says, however much of `noise` is
    resolved.

    There is cloud where normally distributed noise is above a threshold, with an edge of SHARPNESS; what a pixel does
    not resolve of it widens that edge.
    """
    threshold = logit * np.float32(np.sqrt(1 + SHARPNESS**2))
    edge = np.sqrt(1 + np.float32(SHARPNESS**2) - resolved)
    return np.asarray(1 / (1 + np.exp((noise * np.float32(-LOGISTIC) - threshold) / edge)))


def filling_rays(globe: Globe, steps: int) -> tuple[Rays, float]:
    """Rays (N,) that fill the cone in which the planet and its air are seen, and the solid angle of each, sr."""
    axis = globe.centre / globe.distance
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    up = np.cross(axis, across)
    # Rings of equal solid angle: 1 - cos grows evenly.
    versine = globe.angular_radius_sine**2 / (1 + np.sqrt(1 - globe.angular_radius_sine**2))
    v = (np.arange(steps) + 0.5) / steps * versine
    turn = (np.arange(2 * steps) + 0.5) / (2 * steps) * 2 * np.pi
    sine = np.sqrt(v * (2 - v))
    d = (
        (1 - v)[:, None, None] * axis
        + (sine[:, None] * np.cos(turn))[..., None] * across
        + (sine[:, None] * np.sin(turn))[..., None] * up
    ).reshape(-1, 3)
    solid_angle = 2 * np.pi * versine / len(d)
    # They span nothing: each meets the planet or does not.
    rays = Rays(x=d[:, 0], y=d[:, 1], z=d[:, 2], length=np.ones(len(d), np.float32), angle=np.zeros(len(d), np.float32))
    return rays, solid_angle
