"""The light on the pixels at each of a few successive times, from as few renders as possible.

The first, the last and the middle time are rendered. If the middle render differs from its prediction by the others,
both halves are treated in the same way, until two renders are neighbours. So moving highlights and shadows get as many
renders as they need, and what moves with its body gets three. Noise of renders does not count as a difference: it is
recognised by the scatter of the pixels around, and by a second render of the first time. Times at which a target is
small, or shows areas that no render saw, are rendered themselves.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from spin_usd.events.reprojection import Between, KeyRender, ShownPixels, between
from spin_usd.events.time_steps import MOST_PX, SceneAt, sky_moved
from spin_usd.geometry.region import Region
from spin_usd.picture.make_picture import Stopwatch
from spin_usd.picture.pass_maker import PassMaker
from spin_usd.picture.render_file import in_order
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.magnify import finer
from spin_usd.scene.derived.content_keys import RenderSettings, background_seed, render_seed
from spin_usd.scene.derived.light_groups import UnitLight, in_unit_light
from spin_usd.scene.derived.magnification import magnification
from spin_usd.scene.derived.surface import Surface, visible_surface
from spin_usd.scene.event_sensor import EventSensor
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.sensor.develop import light_on_detector

CHUNK = 32  # steps between two that are always rendered
LEAST_RENDERS = 3  # in a chunk
FINE = 2  # the factor by which pixels of renders are finer
LEAST_SAMPLES = 4  # in a fine pixel: with fewer even a denoiser leaves noise that looks like moving light
MOST_UNSEEN = 0.005  # of a body's pixels, unseen by all renders: beyond it the time is rendered
MOST_WRONG = 0.02  # of a body's pixels, off: beyond it there is another render ...
NOISES = 2  # ... if they are so many times as many as are off by a render's noise
WINDOW, AROUND = 5, 9  # pixels over which light is averaged to compare it, and pixels around
DEVIATIONS = 3
PART = 0.5  # of a threshold, the largest error
Float32 = NDArray[np.float32]
Labels = NDArray[np.uint16]

RenderOf = Callable[[UnitLight, int], Radiance]
"""Returns the render of a scene in unit light by so many times finer pixels, new or cached; its region counts these."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LightFrame:
    """The light (H, W) on the pixels at a time, in the unit range, and the ids there.

    seconds: on the stage's clock. labels (2, H, W): the ids of target and part; None if not requested.
    """

    seconds: float
    scene: Scene
    light: Float32
    labels: Labels | None


class LightFrames:
    """Makes the frames of successive `times`, of which neighbours differ little."""

    def __init__(
        self,
        scene_at: SceneAt,
        times: Sequence[float],
        maker: PassMaker,
        render_of: RenderOf,
        settings: RenderSettings,
        sensor: EventSensor,
        *,
        every_step: bool = False,
        labelled: bool = False,
    ) -> None:
        """`every_step`: render all of them, to compare with."""
        self._times, self._maker, self._render_of = times, maker, render_of
        self._settings, self._sensor = settings, sensor
        self._every_step, self._labelled = every_step, labelled
        self._least = min(sensor.threshold_on, sensor.threshold_off)
        self._scene = lru_cache(maxsize=None)(lambda i: scene_at(times[i]))
        self._skies: dict[int, Float32 | None] = {}
        self._keys: dict[int, KeyRender] = {}
        self.rendered = 0

    def frames(self) -> Iterator[LightFrame]:
        """Make one after the other."""
        places = range(len(self._times))
        for place in places:
            if place in (0, places[-1]) or magnification(self._scene(place)) > 1:
                self._key(place)
        for first, last in pairwise(sorted(self._keys)):
            self._refine(first, last)
        for place in places:
            yield self._frame(place)

    def _refine(self, first: int, last: int) -> None:
        """Render the middle of two renders, and, if it differs from their prediction, the middles of both halves."""
        if last - first < 2:
            return
        middle = (first + last) // 2
        self._key(middle)
        if last - first > 2 and (self._every_step or self._is_wrong(first, middle, last)):
            self._refine(first, middle)
            self._refine(middle, last)

    def _is_wrong(self, first: int, middle: int, last: int) -> bool:
        """Return whether too large a share of the pixels in the middle differs from the prediction by the renders
        before and after."""
        own = self._keys[middle]
        seen = ShownPixels.of_surface(own.surface)
        wrong = self._off(self._between(seen, first, middle, last), between(seen, own, own, 0))
        return wrong > MOST_WRONG and wrong > MOST_WRONG + NOISES * self._noise

    @cached_property
    def _noise(self) -> float:
        """That share for two renders of the first time, which differ in noise alone: a denoiser leaves some that looks
        like a change."""
        scene, own = self._scene(0), self._keys[0]
        again = self._render(replace(scene, frame=replace(scene.frame, name=f"{scene.frame.name}_again")))
        seen = ShownPixels.of_surface(own.surface)
        return self._off(*(between(seen, each, each, 0) for each in (again, own)))

    def _off(self, made: Between, real: Between) -> float:
        """Return the share of a body's pixels whose prediction is wrong."""
        surface, region = real.seen.surface, real.seen.region
        if not len(surface.rows):
            return 0.0
        pictures = [each.radiance(surface.scene).rgb[..., 0] for each in (made, real)]
        points = surface.rows - region.y0, surface.columns - region.x0
        dark = self._sensor.dark / surface.scene.sensor.exposure
        off = differ(*pictures, dark=dark, most=PART * self._least)[points]
        return float(np.mean(off | made.unseen))

    def _between(self, seen: ShownPixels, first: int, at: int, last: int) -> Between:
        start, end = self._times[first], self._times[last]
        share = (self._times[at] - start) / (end - start)
        return between(seen, self._keys[first], self._keys[last], share)

    def _key(self, place: int) -> KeyRender:
        self._keys[place] = self._render(self._scene(place))
        return self._keys[place]

    def _render(self, scene: Scene) -> KeyRender:
        light, fine = in_unit_light(scene), fineness(scene, self._settings)
        self.rendered += 1
        return KeyRender(self._surface(scene), light, self._render_of(light, fine), fine)

    def _surface(self, scene: Scene) -> Surface:
        caster = self._maker.caster
        return visible_surface(scene, caster.visibility(scene), caster)

    def _frame(self, place: int) -> LightFrame:
        scene, key = self._scene(place), self._keys.get(place)
        surface = key.surface if key else self._surface(scene)
        seen = ShownPixels.of_surface(surface)
        made = between(seen, key, key, 0) if key else self._around(seen, place)
        if made.unseen.sum() > MOST_UNSEEN * len(made.unseen):
            key = self._key(place)
            made = between(seen, key, key, 0)
        small = magnification(scene) > 1  # the middles of its pixels do not show all of it
        radiance = key.whole if key and small else made.radiance(scene)
        light = light_on_detector(scene, radiance, self._sky_at(place))
        return LightFrame(seconds=self._times[place], scene=scene, light=light, labels=self._labels(surface))

    def _around(self, seen: ShownPixels, place: int) -> Between:
        """Predict the pixels from the renders before and after."""
        first = max(each for each in self._keys if each < place)
        last = min(each for each in self._keys if each > place)
        return self._between(seen, first, place, last)

    def _labels(self, surface: Surface) -> Labels | None:
        if not self._labelled:
            return None
        return np.stack([surface.image(each, np.uint16) for each in (surface.target, surface.part)])

    def _sky_at(self, place: int) -> Float32 | None:
        """Return the sky at a time: a blend between two times that are near enough."""
        first, last = 0, len(self._times) - 1
        while last - first > 1 and sky_moved(self._scene(first), self._scene(last)) > MOST_PX:
            middle = (first + last) // 2
            first, last = (first, middle) if place <= middle else (middle, last)
        start, end = self._sky(first), self._sky(last)
        if start is end or start is None or end is None:
            return start
        share = (self._times[place] - self._times[first]) / (self._times[last] - self._times[first])
        return np.asarray(start + np.float32(share) * (end - start), np.float32)

    def _sky(self, place: int) -> Float32 | None:
        if place not in self._skies:
            scene = self._scene(place)
            self._skies[place] = sky(scene, seed=background_seed(scene, self._settings))
        return self._skies[place]


def differ(first: Float32, last: Float32, *, dark: float, most: float) -> NDArray[np.bool_]:
    """Return the pixels (H, W) around which two pictures of the same light differ, on the average of WINDOW x WINDOW
    pixels, by more than the share `most` of the light there, and of `dark`, and by more than DEVIATIONS times the
    standard deviation of that average, estimated from their scatter."""
    import cv2  # not above: cv2 is slow to load

    apart = first - last
    mean, square = (cv2.blur(each, (WINDOW, WINDOW)) for each in (apart, apart * apart))
    chance = np.sqrt(np.maximum(square - mean * mean, 0)) / WINDOW
    around = cv2.blur(last, (AROUND, AROUND)) + np.float32(dark)
    return np.asarray((np.abs(mean) > most * around) & (np.abs(mean) > DEVIATIONS * chance))


def fineness(scene: Scene, settings: RenderSettings) -> int:
    """Return how many times finer the pixels of renders are than the picture's; 1 for targets that are so small that
    the picture's own render has finer ones, and where nothing is seen."""
    seen = not (scene.picture_region.empty or finer(scene, FINE)[1].empty)
    return FINE if seen and settings.effort.reduction == 1 and magnification(scene) == 1 else 1


def fine_region(scene: Scene, fine: int) -> Region:
    """Return the region of a render of the scene by finer pixels, which it counts from the picture's corner."""
    if fine == 1:
        return scene.picture_region
    shown, frame = finer(scene, fine)
    region = shown.picture_region
    x0, y0 = region.x0 + frame.x0, region.y0 + frame.y0
    return Region(x0=x0, y0=y0, x1=x0 + region.width, y1=y0 + region.height)


def rendered(light: UnitLight, fine: int, maker: PassMaker, settings: RenderSettings) -> Radiance:
    """Render a scene in unit light by finer pixels, with as many rays in each of the picture's, 16 at least."""
    if fine == 1:
        return maker.render(light, settings, Stopwatch())
    assert maker.renderer, "events are made of light"
    shown, _ = finer(light.scene, fine)
    effort = replace(settings.effort, samples=max(settings.effort.samples // fine**2, LEAST_SAMPLES))
    found = in_order(maker.renderer.radiance(shown, effort, seed=render_seed(shown, settings)))
    return replace(found, region=fine_region(light.scene, fine))
