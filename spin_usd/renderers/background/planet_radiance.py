"""The light of a planet: of its sunlit ground, sea and clouds, of its lights by night, and of the air before them."""

import numpy as np

from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.node_grid import NodeGrid
from spin_usd.renderers.background.planet_detail import DetailMaker
from spin_usd.renderers.background.planet_maps import Places, cloud_map, ground_map, night_map
from spin_usd.renderers.background.planet_points import Points
from spin_usd.renderers.background.planet_surface import PlanetSurface
from spin_usd.scene.environment import Planet
from spin_usd.scene.texture import Image

RGB = range(3)


def mean_radiance(points: Points) -> list[Float32]:
    """Return R, G, B, W/m2/sr, of points of any shape by the maps alone, without detail."""
    planet, covered = points.globe.planet, points.meeting.covered
    places = Places.of([n.astype(np.float32) for n in points.meeting.normal], points.meeting.footprint)
    albedo, water = _mean_ground(planet, places)
    clear = np.ones_like(covered)
    if planet.clouds:
        (opacity,) = cloud_map(planet.clouds).at(places)
        clear = 1 - opacity
        white = planet.clouds.pixels[0, 0, :3]
        albedo = [channel + opacity * (w - channel) for channel, w in zip(albedo, white, strict=True)]
    radiance = _air(points)
    for sun in points.suns:
        lit, glossy = sun.lit(sun.cosine) * covered, water * clear * covered
        for c in RGB:
            radiance[c] += albedo[c] * lit * sun.ground[c] + sun.glint[c] * glossy
    if planet.night:
        _add_night(radiance, night_map(planet.night).at(places), clear, _night_light(points))
    return radiance


def _mean_ground(planet: Planet, places: Places) -> tuple[list[Float32], Float32]:
    if not isinstance(planet.albedo, Image):
        return [np.full_like(places.latitude, channel) for channel in planet.albedo], np.zeros_like(places.latitude)
    *albedo, water = ground_map(planet.albedo).at(places)
    return albedo, water


def fine_radiance(nodes: NodeGrid) -> list[Float32]:
    """Return R, G, B, W/m2/sr, at the pixels of `nodes`; the planet fills those that lie between nodes."""
    points = nodes.points
    detail = DetailMaker(nodes, points.weather) if points.weather and points.meeting.covered.any() else None
    surface = detail.surface() if detail else None
    radiance = nodes.enlarged(_air(points))
    for number in range(len(points.suns)):
        _add_sun(radiance, nodes, number, surface)
    if detail and surface and points.globe.planet.night:
        _add_night(radiance, detail.night(), surface.clear, nodes.enlarged(_night_light(points)))
    return radiance


def _add_sun(radiance: list[Float32], nodes: NodeGrid, number: int, surface: PlanetSurface | None) -> None:
    """Add the light of the Sun of that number that ground, clouds and sea send."""
    covered, sun = nodes.points.meeting.covered, nodes.points.suns[number]
    lit = sun.lit(sun.cosine) * covered
    if not lit.any():
        return
    light = nodes.enlarged([lit * channel for channel in sun.ground])
    if not surface:
        for c, channel in enumerate(_uniform(nodes.points.globe.planet)):
            radiance[c] += channel * light[c]
        return
    sunlit = surface.sunlit(number)
    for c, albedo in enumerate(surface.albedo(number, sunlit)):
        radiance[c] += albedo * light[c]
    if sun.glint[0].any() and surface.water.any():
        glossy = surface.glossy(sunlit)
        for c, glint in enumerate(nodes.enlarged([covered * channel for channel in sun.glint])):
            radiance[c] += glint * glossy


def _uniform(planet: Planet) -> list[np.float32]:
    if isinstance(planet.albedo, Image):
        raise TypeError("a planet with a map has weather")
    return [np.float32(channel) for channel in planet.albedo]


def _air(points: Points) -> list[Float32]:
    """Return R, G, B of the light that the air sends, of all Suns."""
    found = [np.zeros_like(points.meeting.covered) for _ in RGB]
    for sun in points.suns:
        for c in RGB:
            found[c] += sun.air[c]
    return found


def _night_light(points: Points) -> list[Float32]:
    """Return R, G, B of the light that comes from where lights by night are brightest."""
    white, covered = points.globe.planet.night_radiance, points.meeting.covered
    return [np.float32(white[c]) * covered * points.through[c] for c in RGB]


def _add_night(radiance: list[Float32], lights: list[Float32], clear: Float32, light: list[Float32]) -> None:
    """Add what shines by itself, as far as clouds are `clear`."""
    for c in RGB:
        radiance[c] += lights[c] * clear * light[c]
