"""One scene to the arrays of one picture: the sentence that the other packages are the words of."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spin_usd.labels.label import LABELS
from spin_usd.render.background.sky import sky
from spin_usd.render.renderer import Renderer
from spin_usd.scene.keys import RenderSettings, picture_seed, render_seed
from spin_usd.scene.light_groups import in_unit_light
from spin_usd.scene.model import Scene
from spin_usd.scene.passes import Radiance
from spin_usd.scene.surface import visible_surface
from spin_usd.sensor.develop import develop
from spin_usd.sensor.exposure import metered

IMAGE = "image"
RADIANCE = "radiance"
RADIANCE_CHANNELS = ("R", "G", "B", "A")
IMAGE_CHANNELS = {"mono": ("Y",), "rgb": ("R", "G", "B")}
KINDS = (IMAGE, RADIANCE, *LABELS)


class Stopwatch:
    """Seconds spent by kind of work."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, work: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[work] = self.seconds.get(work, 0.0) + time.perf_counter() - start


def make_picture(
    scene: Scene,
    renderer: Renderer,
    settings: RenderSettings,
    kinds: Sequence[str],
    watch: Stopwatch,
    notes: dict[str, float],
    *,
    rendered: Radiance | None = None,
) -> Iterator[tuple[str, NDArray[Any], tuple[str, ...]]]:
    """Kind, array and channel names of each of the `kinds`, of the whole frame; renders only what they need.

    `notes` takes what the picture's record must say of how it was made. `rendered`: the picture's radiance where it is
    known; it is then not given again.
    """
    labels = [LABELS[kind] for kind in LABELS if kind in kinds]
    shape = scene.camera.frame.shape
    if labels:
        with watch("label pass"):
            visibility = renderer.visibility(scene)
        with watch("labels"):
            surface = visible_surface(scene, visibility)
        for label in labels:
            with watch("labels"):
                array = label.make(surface, shape)
            yield label.name, array, label.channels
    if IMAGE in kinds or RADIANCE in kinds:
        seed, unit = picture_seed(scene, settings), in_unit_light(scene)
        radiance = rendered
        if radiance is None:
            with watch("beauty pass"):
                rays = render_seed(scene, settings)
                rendered_now = renderer.radiance(unit.scene, samples=settings.samples, seed=rays)
                radiance = rendered_now.relit(unit.gains)
        if IMAGE in kinds:
            with watch("background"):
                behind = sky(scene, seed=seed)
            with watch("sensor"):
                image = develop(scene, radiance, behind, seed=seed)
                if scene.sensor.auto_exposure is not None:
                    notes["auto_exposure"] = metered(scene.sensor, radiance)
            yield IMAGE, image, IMAGE_CHANNELS[scene.sensor.channels]
        if RADIANCE in kinds and rendered is None:
            yield RADIANCE, _full_frame(radiance, shape), RADIANCE_CHANNELS


def _full_frame(radiance: Radiance, shape: tuple[int, int]) -> NDArray[np.float32]:
    frame = np.zeros((*shape, 4), np.float32)
    frame[radiance.region.slices] = radiance.rgba
    return frame
