"""Make the arrays of one picture from its scene, step by step: labels, render, background, sensor."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from msgspec import UNSET
from numpy.typing import NDArray

from spin_usd.labels.table import CLOUD_LABELS, PIXEL_LABELS
from spin_usd.picture.kinds import (
    BEAM_PASS,
    BEAUTY_PASS,
    DEVICE_PASS,
    IMAGE,
    IMAGE_CHANNELS,
    IMAGE_MEANING,
    LABEL_PASS,
    RADIANCE,
    RADIANCE_CHANNELS,
)
from spin_usd.records.record import RecordedTones
from spin_usd.renderers.background.sky import sky
from spin_usd.renderers.downscale import enlarged, reduced
from spin_usd.renderers.magnify import gathered, magnified
from spin_usd.renderers.renderer import LabelPass, Renderer
from spin_usd.scene.channels import Channels
from spin_usd.scene.derived.content_keys import RenderSettings, background_seed, picture_seed, render_seed
from spin_usd.scene.derived.echoes import FirstFaces, echoes
from spin_usd.scene.derived.light_groups import UnitLight
from spin_usd.scene.derived.magnification import magnification
from spin_usd.scene.derived.shadows import RayCaster
from spin_usd.scene.derived.surface import visible_surface
from spin_usd.scene.effort import CPU
from spin_usd.scene.passes import Radiance
from spin_usd.scene.scene import Scene
from spin_usd.scene.sensor import Sensor
from spin_usd.sensor.detector import in_the_dark, when_full
from spin_usd.sensor.develop import develop
from spin_usd.sensor.exposure import exposed, exposure_end, metered
from spin_usd.sensor.tone import written

STOPS = 6  # below full scale: the least light that shows, if the detector adds no noise ...
DEVIATIONS = 3  # ... and if it does, at least that many standard deviations of its noise in the dark
COVERED = 0.5  # of a pixel that counts as the target's


class Stopwatch:
    """Seconds spent by kind of work, by the `clock`."""

    clock = staticmethod(time.perf_counter)

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, work: str) -> Iterator[None]:
        start = self.clock()
        yield
        self.seconds[work] = self.seconds.get(work, 0.0) + self.clock() - start


Made = tuple[str, NDArray[Any], Channels]
"""Kind of file, array of the whole frame, and its channels."""


def make_labels(
    scene: Scene, label_pass: LabelPass, kinds: Sequence[str], watch: Stopwatch, caster: RayCaster | None = None
) -> Iterator[Made]:
    """Make the labels of pixels among `kinds` from one `label_pass`; labels that cast their own rays use the
    `caster`."""
    labels = [label for kind, label in PIXEL_LABELS.items() if kind in kinds]
    if not labels:
        return
    with watch(LABEL_PASS):
        visibility = label_pass.visibility(scene)
    with watch("labels"):
        surface = visible_surface(scene, visibility, caster)
    for label in labels:
        with watch("labels"):
            array = label.make(scene, surface)
        yield label.name, array, label.channels


def make_clouds(
    scene: Scene, first_faces: FirstFaces, kinds: Sequence[str], watch: Stopwatch, *, seed: int
) -> Iterator[Made]:
    """Make the LiDAR's labels among `kinds`, which contain the same points: its beams are cast once."""
    labels = [label for kind, label in CLOUD_LABELS.items() if kind in kinds]
    with watch(BEAM_PASS):
        met = echoes(scene, first_faces)
    for label in labels:
        with watch("labels"):
            cloud = label.make(scene, met, np.random.Generator(np.random.SFC64(seed)))
        yield label.name, cloud, label.channels


def render_in(light: UnitLight, renderer: Renderer, settings: RenderSettings, watch: Stopwatch) -> Radiance:
    """Render the target in unit light: all pictures with this radiance key share this render."""
    with watch(BEAUTY_PASS if settings.device == CPU else DEVICE_PASS):
        seed, by = render_seed(light.scene, settings), settings.effort.reduction
        if (fine := magnification(light.scene)) > 1:  # a reduced render would show even less of it
            found = renderer.radiance(magnified(light.scene, fine), settings.effort, seed=seed)
            return gathered(found, light.scene, fine)
        small = renderer.radiance(reduced(light.scene, by), settings.effort, seed=seed)
        return enlarged(small, light.scene, by)


def make_image(
    scene: Scene,
    radiance: Radiance,
    settings: RenderSettings,
    kinds: Sequence[str],
    watch: Stopwatch,
    notes: dict[str, float],
) -> Iterator[Made]:
    """Make the image and the radiance file, if in `kinds`, from the target's radiance in the scene's own light.

    `notes` collects facts on the making for the picture's record.
    """
    if IMAGE in kinds:
        with watch("background"):
            behind = sky(scene, seed=background_seed(scene, settings), hidden=_hidden(scene, radiance))
        with watch("sensor"):
            image = develop(scene, radiance, behind, seed=picture_seed(scene, settings))
            if scene.sensor.auto_exposure is not None:
                notes["auto_exposure"] = metered(scene.sensor, radiance)
        yield IMAGE, image, image_channels(scene.sensor)
    if RADIANCE in kinds:
        yield RADIANCE, _full_frame(radiance, scene.camera.frame.shape), RADIANCE_CHANNELS


def _hidden(scene: Scene, radiance: Radiance) -> NDArray[np.bool_]:
    """Return the pixels (H, W) of the frame that the bodies cover completely."""
    hidden = np.zeros(scene.camera.frame.shape, bool)
    hidden[radiance.region.slices] = radiance.coverage >= 1
    return hidden


def image_tones(scene: Scene, radiance: Radiance, image: NDArray[Any]) -> RecordedTones | None:
    """Return the record's brightness of the target in the `image` that was made of its `radiance`; None if the target
    is not visible."""
    tones, end = target_tones(image, radiance, scene.sensor), exposure_end(scene.sensor, radiance)
    return None if tones is None else RecordedTones(**asdict(tones), exposure_end=end or UNSET)


def image_channels(sensor: Sensor) -> Channels:
    """Return the channels of the image of `sensor`."""
    return Channels(
        meaning=IMAGE_MEANING,
        dtype=f"uint{sensor.bit_depth}",
        holds=IMAGE_CHANNELS[sensor.channels],
        encoding=sensor.encoding,
        gamma=sensor.gamma if sensor.encoding == "gamma" else None,
    )


def _full_frame(radiance: Radiance, shape: tuple[int, int]) -> NDArray[np.float32]:
    frame = np.zeros((*shape, 4), np.float32)
    frame[radiance.region.slices] = radiance.rgba
    return frame


@dataclass(frozen=True, kw_only=True)
class Tones:
    """Brightness of the target's `pixels` in an image: their `mean`, as a share of the highest number; the shares of
    them that are `dark`, too near to black to show in every channel, and `saturated`, in every one as bright
    as a full detector is written. Both are of the detector: contrast and filter only change the numbers for them."""

    pixels: int
    mean: float
    dark: float
    saturated: float


def target_tones(image: NDArray[Any], radiance: Radiance, sensor: Sensor) -> Tones | None:
    """Return the tones of `image`, (H, W) or (H, W, 3), which `sensor` wrote of the target's `radiance`; None where no
    pixel is the target's."""
    covered = radiance.coverage >= COVERED
    if not covered.any():
        return None
    numbers = image[radiance.region.slices][covered].reshape(int(covered.sum()), -1)
    full, noise = when_full(sensor)
    signals = (_least_shown(exposed(sensor, radiance)), full - DEVIATIONS * noise)
    dark, saturated = (written(np.full(numbers.shape[1], signal), sensor) for signal in signals)
    return Tones(
        pixels=len(numbers),
        mean=float(numbers.mean(dtype=np.float64)) / (2**sensor.bit_depth - 1),
        dark=float((numbers <= dark).all(-1).mean()),
        saturated=float((numbers >= saturated).all(-1).mean()),
    )


def _least_shown(sensor: Sensor) -> float:
    """Return the least signal that shows, in the unit range."""
    black, noise = in_the_dark(sensor)
    return float(min(black + max((1 - black) / 2**STOPS, DEVIATIONS * noise), 1.0))
