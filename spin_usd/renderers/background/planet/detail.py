"""Detail finer than a planet's maps: what they show, and noise, put together at each pixel of a block."""

from collections.abc import Sequence

import numpy as np

from spin_usd.renderers.background.arithmetic.elementary import Float32, exp, log
from spin_usd.renderers.background.arithmetic.enlarge import enlarged
from spin_usd.renderers.background.noise.octaves import octave, resolved
from spin_usd.renderers.background.noise.tile import MEAN_WAVE
from spin_usd.renderers.background.planet.maps import Places, cloud_map, ground_map, night_map, ramp, shores
from spin_usd.renderers.background.planet.points import Points
from spin_usd.renderers.background.planet.surface import LOGISTIC, SHARPNESS, PlanetSurface
from spin_usd.renderers.background.planet.weather import Weather
from spin_usd.scene.texture import Image

WAVE_TEXELS = 6.0  # the longest waves of detail, in texels of the maps
RATIO = 2.03  # of the wavelengths of neighbouring octaves
GAIN = 0.72  # of their amplitudes
RELIEF_GAIN = 0.75  # of their heights, besides: finer detail is thickness and colour, hardly slope
FINEST_RELIEF = 0.25  # scale heights of the air: the waves by which relief has a half of its height
MAX_OCTAVES = 16
CLOSE = 6.0  # of the longest wave, below which pixels must be for any of them: one octave alone is a pattern of dots
SLOPE_STRIDE = 2  # pixels, at least, from one to the next of the points at which slopes are looked up
STEPS = 8  # points in a wave, at least, between which it is interpolated
MEAN_FOLDED = 0.798  # the mean of the absolute value of a normally distributed number
MIN_OPACITY = 0.002
MAP_TEXELS = 0.7  # from one look-up in a map to the next, between which it is interpolated
MAP_SWIRL = 0.15  # of the clouds' swirl, by which maps are moved: so nothing shows their texels
SHARP, MOST_SHARP = 4.0, 8.0  # pixels in a texel from which coasts are sharper than the map, and how much at most
RAGGED = 0.25  # by which noise moves a coast, in shares of water
VEIL_WAVES = (0.025, 0.0015)  # the longest and the shortest of the fibres of high clouds, radians
VEIL_STRETCH, VEIL_GAIN, VEIL_OPACITY = 4.0, 0.7, 0.25


class DetailMaker:
    """Makes the surface at `points` (R, C) with `weather` that lie `spacing` pixels from one another; those of the last
    row and column only say how the others go on."""

    def __init__(self, points: Points, weather: Weather, spacing: int) -> None:
        self._points, self._weather, self._spacing = points, weather, spacing
        self._planet, self._footprint = points.globe.planet, points.meeting.footprint
        self._widest = float(self._footprint.max())
        maps = (self._planet.albedo, self._planet.clouds, self._planet.night)
        images = [image for image in maps if isinstance(image, Image)]
        self._texel = 2 * np.pi / max(image.pixels.shape[1] for image in images)
        self._map_stride = self._stride(self._texel * MAP_TEXELS)
        self._places = self._make_places()
        self._scale_height = np.float32(self._planet.atmosphere * 3 / sum(self._planet.radii))

    def surface(self) -> PlanetSurface:
        """Return the surface of the block's pixels."""
        weather, planet = self._weather, self._planet
        noise, variance, slopes = self._noise()
        ground, water = self._ground(noise)
        edge, ranges = self._up(np.sqrt(np.float32(1 + SHARPNESS**2) - variance), weather.ranges)
        thick, opacity = noise, np.zeros_like(noise)
        if planet.clouds:
            threshold = self._threshold(planet.clouds)
            thick = (noise + threshold) * (np.float32(LOGISTIC) / edge)
            opacity = np.asarray(1 / (1 + exp(-thick)), np.float32)
        return PlanetSurface(
            ground=_cut(ground),
            water=_cut([water])[0],
            opacity=_cut([opacity])[0],
            thick=_cut([thick])[0],
            veil=self._veil() if planet.clouds else None,
            white=tuple(planet.clouds.pixels[0, 0, :3].tolist()) if planet.clouds else (0.0, 0.0, 0.0),
            noise=_cut([noise])[0],
            edge=_cut([edge])[0],
            ranges=_cut([ranges])[0],
            slopes=_cut(slopes),
            height=self._scale_height,
        )

    def night(self) -> list[Float32]:
        """Return R, G, B of what shines by itself, of a map of it."""
        assert self._planet.night
        return _cut(enlarged(night_map(self._planet.night).at(self._places), self._map_stride))

    def _up(self, *values: Float32, to: int = 1) -> list[Float32]:
        return enlarged(values, self._spacing // to)

    def _stride(self, length: float) -> int:
        """Return the pixels between points that are `length` apart at most, radians; 1 where pixels are wider."""
        stride = self._spacing
        while stride > 1 and stride * self._widest > length:
            stride //= 2
        return stride

    def _make_places(self) -> Places:
        a, b = (swirl * np.float32(MAP_SWIRL) for swirl in self._weather.swirl)
        x, y, z = (n.astype(np.float32) for n in self._points.meeting.normal)
        *normal, footprint = self._up(x + a, y + b, z + a, self._footprint, to=self._map_stride)
        return Places.of(normal, footprint)

    def _noise(self) -> tuple[Float32, Float32, list[Float32]]:
        """Return the noise at the pixels, how much of its whole variance of 1 is resolved, at the points, and how fast
        its relief rises toward each Sun, at the pixels."""
        weather, coarsest = self._weather, WAVE_TEXELS * self._texel
        close = resolved(self._footprint, coarsest / CLOSE)
        total, variance, stride = np.zeros_like(self._footprint), np.zeros_like(self._footprint), self._spacing
        slopes = _Slopes(self._points, self._spacing, FINEST_RELIEF * float(self._scale_height))
        for number, wave, share in _octaves(coarsest, GAIN):
            seen = resolved(self._footprint, wave) * close
            if not seen.any():
                break
            to = min(self._stride(wave / STEPS), stride)
            (total,), stride = enlarged([total], stride // to), to
            seen_part = seen * np.float32(np.sqrt(share))
            plain, folded = self._up(seen_part * weather.plain, seen_part * weather.cells, to=to)
            found = octave(self._points.faces, wave, number, finer=self._spacing // to)
            slopes.add(found, plain, folded, number, wave, to)
            total += found * plain
            total += (np.abs(found) - np.float32(MEAN_FOLDED)) * folded
            variance += np.float32(share) * seen * seen
        return enlarged([total], stride)[0], variance, slopes.at_pixels()

    def _veil(self) -> Float32 | None:
        """Return the opacity of thin high clouds; None where there is none."""
        coarsest, finest = VEIL_WAVES
        close = resolved(self._footprint, coarsest / CLOSE)
        if float(self._weather.veil.max()) < -1 or not close.any():
            return None
        total, stride = self._weather.veil, self._spacing
        for number, wave, share in _octaves(coarsest, VEIL_GAIN):
            seen = resolved(self._footprint, wave)
            if wave < finest or not seen.any():
                break
            to = min(self._stride(wave / STEPS), stride)
            (total,), stride = enlarged([total], stride // to), to
            (part,) = self._up(seen * np.float32(0.6 * np.sqrt(share)), to=to)
            total = total + part * octave(self._points.faces, wave, 20 + number, VEIL_STRETCH, self._spacing // to)
        thin = ramp(total, 0.4, 2.6) * self._up(close, to=stride)[0]
        return enlarged([thin * np.float32(VEIL_OPACITY)], stride)[0][:-1, :-1]

    def _threshold(self, clouds: Image) -> Float32:
        """Return the number that makes noise a cloud where it is above: so much of them as the map says.

        There is cloud where normally distributed noise is above a threshold, with an edge of SHARPNESS; what a pixel
        does not resolve of it widens that edge.
        """
        (cover,) = cloud_map(clouds).at(self._places)
        within = np.clip(cover, MIN_OPACITY, 1 - MIN_OPACITY)
        logit = log(within / (1 - within)) * np.float32(np.sqrt(1 + SHARPNESS**2) / LOGISTIC)
        return enlarged([logit], self._map_stride)[0]

    def _ground(self, noise: Float32) -> tuple[list[Float32], Float32]:
        """Return R, G, B of the albedo and the share of water, of coasts as sharp as the pixels."""
        albedo = self._planet.albedo
        if not isinstance(albedo, Image):
            return [np.full_like(noise, channel) for channel in albedo], np.zeros_like(noise)
        red, green, blue, water = enlarged(ground_map(albedo).at(self._places), self._map_stride)
        ground = [red, green, blue]
        if self._texel <= SHARP * float(self._footprint.min()):
            return ground, water
        (sharp,) = self._up(np.clip(np.float32(self._texel / SHARP) / self._footprint, 1, MOST_SHARP))
        ragged = np.float32(4 * RAGGED) * noise * np.minimum(sharp - 1, 1) * water * (1 - water)
        shore = np.clip((water - np.float32(0.5) + ragged) * sharp + np.float32(0.5), 0, 1)
        more, changes = shore - water, enlarged(shores(albedo).at(self._places), self._map_stride)
        return [c + more * change for c, change in zip(ground, changes, strict=True)], shore


class _Slopes:
    """How fast the relief of the octaves of noise rises toward each Sun, times the tangent of its zenith angle.

    Each octave is looked up again a little way toward the Sun: differences between pixels would show the facets of what
    is interpolated between points.
    """

    def __init__(self, points: Points, spacing: int, finest: float) -> None:
        self._points, self._spacing, self._finest = points, spacing, finest
        self._stride = spacing
        self._totals = [np.zeros_like(points.meeting.footprint) for _ in points.suns]

    def add(self, found: Float32, plain: Float32, folded: Float32, number: int, wave: float, stride: int) -> None:
        """Add an octave, as it is found every `stride` pixels."""
        if not 2 * wave > self._finest > 0:
            return
        to = max(stride, min(SLOPE_STRIDE, self._stride))
        every, step = slice(None, None, to // stride), wave / MEAN_WAVE
        found, plain, folded = (plane[every, every] for plane in (found, plain, folded))
        relief = np.float32(RELIEF_GAIN**number * wave**2 / (wave**2 + self._finest**2) / step)
        if to < self._stride:
            self._totals, self._stride = enlarged(self._totals, self._stride // to), to
        for sun, total in enumerate(self._totals):
            moved = [face.moved(sun, step) for face in self._points.faces]
            ahead = octave(moved, wave, number, finer=self._spacing // to)
            rise = (ahead - found) * plain + (np.abs(ahead) - np.abs(found)) * folded
            total += rise * relief

    def at_pixels(self) -> list[Float32]:
        """Return the sums of all octaves."""
        fine = enlarged(self._totals, self._stride)
        steep = enlarged(list(self._points.steep), self._spacing)
        return [total * tangent for total, tangent in zip(fine, steep, strict=True)]


def _octaves(coarsest: float, gain: float) -> list[tuple[int, float, float]]:
    """Return number, wave and share of the variance of each octave; all shares, of infinitely many, are 1."""
    return [(k, coarsest / RATIO**k, (1 - gain**2) * gain ** (2 * k)) for k in range(MAX_OCTAVES)]


def _cut(values: Sequence[Float32]) -> list[Float32]:
    return [plane[:-1, :-1] for plane in values]
