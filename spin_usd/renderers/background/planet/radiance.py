"""The light of a planet: of its sunlit ground, sea and clouds, of its lights by night, and of the air before them."""

from dataclasses import dataclass

import numpy as np

from spin_usd.renderers.background.arithmetic.elementary import Float32
from spin_usd.renderers.background.arithmetic.enlarge import enlarged
from spin_usd.renderers.background.planet.detail import DetailMaker
from spin_usd.renderers.background.planet.maps import Places, cloud_map, ground_map, night_map
from spin_usd.renderers.background.planet.points import Points
from spin_usd.renderers.background.planet.sunlight import SunAtPoints
from spin_usd.renderers.background.planet.surface import PlanetSurface
from spin_usd.scene.environment import Planet
from spin_usd.scene.texture import Image

RGB = range(3)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetRadiance:
    """Light from points. radiance: R, G, B, W/m2/sr, of planet and air · transmittance: R, G, B, the share of what lies
    behind that they let through."""

    radiance: list[Float32]
    transmittance: list[Float32]


def mean_radiance(points: Points) -> PlanetRadiance:
    """Return the light of points of any shape by the maps alone, without detail."""
    planet, covered = points.globe.planet, points.meeting.covered
    places = Places.of([n.astype(np.float32) for n in points.meeting.normal], points.meeting.footprint)
    albedo, water = _mean_ground(planet, places)
    clear = np.ones_like(covered)
    if planet.clouds:
        (opacity,) = cloud_map(planet.clouds).at(places)
        clear = 1 - opacity
        white = planet.clouds.pixels[0, 0, :3]
        albedo = [channel + opacity * (w - channel) for channel, w in zip(albedo, white, strict=True)]
    radiance = [np.zeros_like(covered) for _ in RGB]
    for sun in points.suns:
        lit, glossy = sun.lit(sun.cosine) * covered, water * clear * covered
        for c in RGB:
            radiance[c] += albedo[c] * lit * sun.ground[c] + sun.glint[c] * glossy + sun.air[c]
    if planet.night:
        _add_night(radiance, planet, night_map(planet.night).at(places), clear * covered, points.through)
    return PlanetRadiance(radiance=radiance, transmittance=[(1 - covered) * through for through in points.through])


def _mean_ground(planet: Planet, places: Places) -> tuple[list[Float32], Float32]:
    if not isinstance(planet.albedo, Image):
        return [np.full_like(places.latitude, channel) for channel in planet.albedo], np.zeros_like(places.latitude)
    *albedo, water = ground_map(planet.albedo).at(places)
    return albedo, water


def fine_radiance(points: Points, spacing: int) -> PlanetRadiance:
    """Return the light (H, W) of a block of pixels, of points (R, C) that lie `spacing` pixels from one another; those
    of the last row and column only say how the others go on."""
    covered, *through = _pixels([points.meeting.covered, *points.through], spacing)
    detail = DetailMaker(points, points.weather, spacing) if points.weather and covered.any() else None
    surface = detail.surface() if detail else None
    radiance = [np.zeros_like(covered) for _ in RGB]
    for number in range(len(points.suns)):
        _add_sun(radiance, points, number, surface, covered, spacing)
    planet = points.globe.planet
    if detail and surface and planet.night:
        _add_night(radiance, planet, detail.night(), surface.clear * covered, through)
    return PlanetRadiance(radiance=radiance, transmittance=[(1 - covered) * share for share in through])


def _pixels(values: list[Float32], spacing: int) -> list[Float32]:
    return [plane[:-1, :-1] for plane in enlarged(values, spacing)]


def _add_sun(
    radiance: list[Float32], points: Points, number: int, surface: PlanetSurface | None, covered: Float32, spacing: int
) -> None:
    """Add the light that comes from the Sun of that number."""
    sun: SunAtPoints = points.suns[number]
    cosine, *light = _pixels([sun.cosine, *sun.ground, *sun.air], spacing)
    lit = sun.lit(cosine) * covered
    for c in RGB:
        radiance[c] += light[3 + c]
    if not lit.any():
        return
    albedo = surface.albedo(number) if surface else _uniform(points.globe.planet)
    for c in RGB:
        radiance[c] += albedo[c] * (lit * light[c])
    if surface and sun.glint[0].any():
        glossy = surface.glossy(number) * covered
        for c, glint in enumerate(_pixels(sun.glint, spacing)):
            radiance[c] += glint * glossy


def _uniform(planet: Planet) -> list[Float32]:
    if isinstance(planet.albedo, Image):
        raise TypeError("a planet with a map has weather")
    return [np.asarray(channel, np.float32) for channel in planet.albedo]


def _add_night(
    radiance: list[Float32], planet: Planet, lights: list[Float32], seen: Float32, through: list[Float32]
) -> None:
    """Add what shines by itself, as far as it is `seen` past clouds."""
    for c in RGB:
        radiance[c] += lights[c] * (np.float32(planet.night_radiance[c]) * seen * through[c])
