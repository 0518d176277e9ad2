"""The light of a planet: of its sunlit ground, sea and clouds, of its lights by night, and of the air before them.

Detail finer than the planet's maps, and noise, are put together at each pixel of a block.
"""

import numpy as np

from spin_usd.renderers.background.elementary import Float32
from spin_usd.renderers.background.enlarge import enlarged
from spin_usd.renderers.background.globe import Globe
from spin_usd.renderers.background.node_grid import NodeGrid, Octave
from spin_usd.renderers.background.noise_octaves import MEAN_WAVE, octave, resolved
from spin_usd.renderers.background.planet_maps import Map, Places, cloud_map, ground_map, night_map, ramp, shores
from spin_usd.renderers.background.planet_points import Points
from spin_usd.renderers.background.planet_sunlight import SunAtPoints
from spin_usd.renderers.background.planet_surface import (
    CLOSE,
    Clouds,
    PlanetSurface,
    firmness_of,
    threshold_of,
    veil_opacity,
)
from spin_usd.renderers.background.weather import Weather
from spin_usd.scene.environment import Planet
from spin_usd.scene.texture import Image

RGB = range(3)
WAVE_TEXELS = 6.0  # the longest waves of detail, in texels of the maps
GAIN = 0.72  # of the amplitudes of neighbouring octaves
MEAN_FOLDED = np.float32(0.798)  # the mean of the absolute value of a normally distributed number
MAP_TEXELS = 0.7  # from one look-up in a map to the next, between which it is interpolated
MAP_SWIRL = 0.15  # of the clouds' swirl, by which maps are moved: so nothing shows their texels
SHARP, MOST_SHARP = 4.0, 8.0  # pixels in a texel from which coasts are sharper than the map, and how much at most
RAGGED = 0.25  # by which noise moves a coast, in shares of water
RELIEF_GAIN = 0.75  # of the octaves' heights, besides their own: finer detail is thickness and colour, hardly slope
FINEST_RELIEF = 0.25  # scale heights of the air: the waves by which relief has a half of its height
STRIDE = 2  # pixels, at least, from one to the next of the points at which slopes are looked up
LOW = np.float32(0.15)  # the cosine of a Sun's zenith angle, below which slopes gain no more contrast
HIGH = (0.2, 0.5)  # the tangents of that angle, below and above which slopes show nothing and all


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
            radiance[c] += with_light_from_air(albedo[c], points.globe, c) * lit * sun.ground[c] + sun.glint[c] * glossy
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
    globe, covered, sun = nodes.points.globe, nodes.points.meeting.covered, nodes.points.suns[number]
    lit = sun.lit(sun.cosine) * covered
    if not lit.any():
        return
    light = nodes.enlarged([lit * channel for channel in sun.ground])
    if not surface:
        for c, channel in enumerate(_uniform(globe.planet)):
            radiance[c] += with_light_from_air(channel, globe, c) * light[c]
        return
    sunlit = surface.sunlit(number)
    for c, albedo in enumerate(surface.albedo(number, sunlit, nodes.enlarged(sun.skylight) if globe.air else None)):
        radiance[c] += with_light_from_air(albedo, globe, c) * light[c]
    if sun.glint[0].any() and surface.water.any():
        glossy = surface.glossy(sunlit)
        for c, glint in enumerate(nodes.enlarged([covered * channel for channel in sun.glint])):
            radiance[c] += glint * glossy


def _uniform(planet: Planet) -> list[Float32]:
    if isinstance(planet.albedo, Image):
        raise TypeError("a planet with a map has weather")
    return [np.array(channel, np.float32) for channel in planet.albedo]


def with_light_from_air(albedo: Float32, globe: Globe, channel: int) -> Float32:
    """Return the albedo of wide ground, with the light that air sends back to it and it reflects again."""
    if not globe.air:
        return albedo
    return np.asarray(albedo / (1 - np.minimum(albedo, 1) * globe.air.returned[channel]))


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
    """Add emission, as far as clouds are `clear`."""
    for c in RGB:
        radiance[c] += lights[c] * clear * light[c]


class Slopes:
    """How much the relief of octaves of noise rises toward each Sun, over a scale height of the air and times the
    tangent of the Sun's zenith angle.

    Each octave is looked up again a little way toward the Sun: differences between pixels would show the facets of what
    is interpolated between points.
    """

    def __init__(self, nodes: NodeGrid) -> None:
        self._nodes, self._stride = nodes, nodes.spacing
        self._height = nodes.points.globe.scale_height
        self._steep = [_steep(sun) for sun in nodes.points.suns]
        self._totals: dict[int, Float32] = {}

    def add(self, found: Octave, values: Float32, plain: Float32, folded: Float32) -> None:
        """Add an octave of those `values`: the share `plain` unchanged, the share `folded` as absolute value."""
        finest, step = FINEST_RELIEF * self._height, found.wave / MEAN_WAVE
        if not 2 * found.wave > finest > 0:
            return
        to = max(found.stride, min(STRIDE, self._stride))
        values, plain, folded = (_every(plane, to // found.stride) for plane in (values, plain, folded))
        height = self._height * RELIEF_GAIN**found.number * found.wave**2 / (found.wave**2 + finest**2)
        for sun, steep in enumerate(self._steep):
            if steep.any():
                moved = [face.moved(sun, step) for face in self._nodes.points.faces]
                ahead = octave(moved, found.wave, found.number, finer=self._nodes.spacing // to)
                rise = (ahead - values) * plain + (np.abs(ahead) - np.abs(values)) * folded
                self._add(sun, np.asarray(rise * np.float32(height / step)), to)
        self._stride = to

    def _add(self, sun: int, rise: Float32, stride: int) -> None:
        if sun in self._totals:
            (before,) = enlarged([self._totals[sun]], self._stride // stride)
            rise += before
        self._totals[sun] = rise

    def at_pixels(self) -> list[Float32 | None]:
        """Return the sum of all octaves for each Sun; None where it is 0 everywhere."""
        found: list[Float32 | None] = [None] * len(self._steep)
        for sun, total in self._totals.items():
            (steep,) = self._nodes.enlarged([self._steep[sun]], to=self._stride)
            (found[sun],) = enlarged([total * steep], self._stride)
        return found


def _every(plane: Float32, step: int) -> Float32:
    return plane if step == 1 else plane[::step, ::step]


def _steep(sun: SunAtPoints) -> Float32:
    """Return the tangent of the Sun's zenith angle, as far as it says how bright slopes are."""
    tangent = np.sqrt(np.maximum(1 - sun.cosine * sun.cosine, 0)) / np.maximum(sun.cosine, LOW)
    return np.asarray(tangent * ramp(tangent, *HIGH), np.float32)


class DetailMaker:
    """Makes the surface at the pixels of `nodes` with `weather`, of a planet that has maps."""

    def __init__(self, nodes: NodeGrid, weather: Weather) -> None:
        self._nodes, self._weather = nodes, weather
        self._planet, self._footprint = nodes.points.globe.planet, nodes.points.meeting.footprint
        maps = (self._planet.albedo, self._planet.clouds, self._planet.night)
        images = [image for image in maps if isinstance(image, Image)]
        self._texel = 2 * np.pi / max(image.pixels.shape[1] for image in images)
        self._stride = nodes.stride(self._texel * MAP_TEXELS)
        self._places = self._make_places()

    def surface(self) -> PlanetSurface:
        """Return the surface at the pixels."""
        slopes = Slopes(self._nodes)
        noise, variance = self._noise(slopes)
        ground, water = self._ground(noise)
        clouded = self._planet.clouds is not None
        return PlanetSurface(
            ground=ground,
            water=water,
            noise=noise,
            ranges=self._nodes.enlarged([self._weather.ranges])[0],
            rises=slopes.at_pixels(),
            clouds=self._clouds(self._planet.clouds, noise, variance) if self._planet.clouds else None,
            veil=veil_opacity(self._nodes, self._weather) if clouded else None,
        )

    def night(self) -> list[Float32]:
        """Return R, G, B of emission from its map."""
        assert self._planet.night
        return enlarged(night_map(self._planet.night).at(self._places), self._stride)

    def _make_places(self) -> Places:
        a, b = (swirl * np.float32(MAP_SWIRL) for swirl in self._weather.swirl)
        x, y, z = (n.astype(np.float32) for n in self._nodes.points.meeting.normal)
        *normal, footprint = self._nodes.enlarged([x + a, y + b, z + a, self._footprint], to=self._stride)
        return Places.of(normal, footprint)

    def _noise(self, slopes: Slopes) -> tuple[Float32, Float32]:
        """Return the noise at the pixels and how much of its whole variance of 1 is resolved, at the nodes. Its octaves
        are added to `slopes`."""
        nodes, coarsest = self._nodes, WAVE_TEXELS * self._texel
        close = resolved(self._footprint, coarsest / CLOSE)
        total, variance, stride = np.zeros_like(close), np.zeros_like(close), nodes.spacing
        for found in nodes.octaves(coarsest, GAIN) if close.any() else ():
            (total,), stride = enlarged([total], stride // found.stride), found.stride
            amplitude = found.amplitude * close
            parts = [amplitude * self._weather.plain, amplitude * self._weather.cells]
            plain, folded = nodes.enlarged(parts, to=stride)
            values = octave(nodes.points.faces, found.wave, found.number, finer=nodes.spacing // stride)
            slopes.add(found, values, plain, folded)
            total += values * plain
            total += (np.abs(values) - MEAN_FOLDED) * folded
            variance += amplitude * amplitude
        return enlarged([total], stride)[0], variance

    def _clouds(self, clouds: Image, noise: Float32, variance: Float32) -> Clouds:
        """Return the clouds, in the amount of their map."""
        (cover,) = cloud_map(clouds).at(self._places)
        (threshold,) = enlarged([threshold_of(cover)], self._stride)
        (firmness,) = self._nodes.enlarged([firmness_of(variance)])
        return Clouds.of(noise, threshold, firmness, tuple(clouds.pixels[0, 0, :3].tolist()))

    def _ground(self, noise: Float32) -> tuple[list[Float32], Float32]:
        """Return R, G, B of the albedo and the share of water, of coasts as sharp as the pixels."""
        albedo = self._planet.albedo
        if not isinstance(albedo, Image):
            return [np.full_like(noise, channel) for channel in albedo], np.zeros_like(noise)
        found = ground_map(albedo).at(self._places)
        *ground, water = enlarged(found, self._stride)
        sharper = np.clip(np.float32(self._texel / SHARP) / self._footprint, 1, MOST_SHARP) - 1
        if not sharper.any() or not ((found[3] > 0) & (found[3] < 1)).any():
            return ground, water
        shore = self._shore(water, noise, sharper)
        return self._moved(ground, shore - water, shores(albedo)), shore

    def _shore(self, water: Float32, noise: Float32, sharper: Float32) -> Float32:
        """Return the share of water of ragged coasts, `sharper` by that factor than the map's at the nodes."""
        ragged = np.minimum(sharper, 1) * (1 + sharper) * np.float32(4 * RAGGED)
        sharper, ragged = self._nodes.enlarged([sharper, ragged])
        shore = water + (water - np.float32(0.5)) * sharper
        shore += ragged * noise * water * (1 - water)
        return np.clip(shore, 0, 1, out=shore)

    def _moved(self, ground: list[Float32], more: Float32, changes: Map) -> list[Float32]:
        """Return the colours of ground whose share of water is greater by `more`."""
        found = enlarged(changes.at(self._places), self._stride)
        return [channel + more * change for channel, change in zip(ground, found, strict=True)]
