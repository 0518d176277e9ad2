"""The work of making a picture: for each kind of work its number of units, such as samples on the target.

Kinds of work have the names that workers report. The cost of a unit is in `cost`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from spin_usd.labels.table import CLOUD_LABELS, LABELS
from spin_usd.picture.kinds import BEAM_PASS, BEAUTY_PASS, DEVICE_PASS, IMAGE, LABEL_PASS, RENDERED
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.scene.derived.light_groups import LightGroups
from spin_usd.scene.derived.shown_materials import shown_materials
from spin_usd.scene.effort import CPU, LOOKS_EVERY, Effort
from spin_usd.scene.light import DomeLight
from spin_usd.scene.scene import Scene

Units = dict[str, float]
BEHIND = ("planet", "stars", "back plate", "dome")
THROUGH_OPTICS, NOISE = ("vignetting", "spread", "glare", "bloom"), "noise"
COSTLY_STEPS = ("glare", "bloom", NOISE)
LIT = ("glossy", "surroundings")
ADAPTIVE_SAMPLES, ADAPTIVE_POWER = 3.0, -1.2
"""For a glossy target: samples a pixel, on average, times the requested noise to that power (measured at 0.1, 0.03 and
0.01 on a metal under Sun and lamp: 48, 200 and 800). A matt one hardly takes more than the least."""


@dataclass(frozen=True, kw_only=True)
class PictureWork:
    """A picture to make, and the passes that it needs itself: the others are in the cache by then."""

    picture: PlannedPicture
    label_pass: bool
    render: bool


@dataclass(frozen=True, kw_only=True)
class CommonWork:
    """The options that all pictures of a run share: renderer, effort, kinds of file, pixels of the whole frame, and the
    device, of renderers.device.DEVICES."""

    renderer: str
    effort: Effort
    kinds: tuple[str, ...]
    frame_pixels: int
    device: str = CPU

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(kind for kind in self.kinds if kind in LABELS)

    @property
    def light_pass(self) -> str:
        """Return the kind of work of a render."""
        return BEAUTY_PASS if self.device == CPU else DEVICE_PASS

    @property
    def renders(self) -> bool:
        """Return whether pictures need a render: labels alone do not."""
        return not RENDERED.isdisjoint(self.kinds)


@dataclass(frozen=True, kw_only=True)
class Work:
    """A picture's work in seconds of one core, more or less."""

    render: float
    """Uses all of a worker's cores."""
    rest: float
    """Uses one core."""
    device: float = 0.0
    """Seconds of a graphics processor, which all workers share."""

    @classmethod
    def of(cls, seconds: Mapping[str, float]) -> "Work":
        """Sum up seconds by kind of work."""
        render, device = (seconds.get(kind, 0.0) for kind in (BEAUTY_PASS, DEVICE_PASS))
        return cls(render=render, rest=sum(seconds.values()) - render - device, device=device)

    @property
    def total(self) -> float:
        return self.render + self.rest + self.device


def features(scene: Scene) -> list[str]:
    """Return the features of the scene that cost time, of BEHIND, THROUGH_OPTICS, NOISE and LIT."""
    behind, optics, sensor = scene.environment, scene.optics, scene.sensor
    shown = [shown_materials(body.target) for body in scene.bodies]
    has = {
        "planet": bool(behind.planets),
        "stars": bool(behind.stars),
        "back plate": behind.back_plate is not None,
        "dome": any(isinstance(light, DomeLight) for light in scene.lights),
        "vignetting": optics.cos_fourth or any(optics.vignetting),
        "spread": optics.psf_sigma > 0,
        "glare": optics.glare > 0,
        "bloom": optics.bloom_intensity > 0,
        NOISE: sensor.gain > 0,
        "glossy": not all(each.diffuse for each in shown),
        "surroundings": LightGroups.of(scene).surroundings,
    }
    return [name for name, there in has.items() if there]


def work_units(task: PictureWork, options: CommonWork) -> dict[str, Units]:
    """Return by kind of work the units of each that the picture takes."""
    picture, frame = task.picture, float(options.frame_pixels)
    files = sum(task.label_pass or kind not in LABELS for kind in options.kinds)
    found: dict[str, Units] = {work: {"picture": 1} for work in ("stage", "cache", "facts")}
    found["files"] = {"pixel": files * frame}
    if task.label_pass:
        found[LABEL_PASS] = {"picture": 1, "pixel": picture.region_pixels}
        if any(kind in CLOUD_LABELS for kind in options.kinds):
            found[BEAM_PASS] = {"picture": 1}
        costly = {name: picture.target_pixels for name in options.labels if LABELS[name].target_s}
        found["labels"] = {"pixel": picture.region_pixels, "target": picture.target_pixels, **costly}
    if task.render:
        found[options.light_pass] = {"picture": 1, **dict(_light(picture, options))}
    elif options.renders:
        found["cache"]["pixel"] = picture.region_pixels
    if IMAGE in options.kinds:
        behind = {"planet" if name == "planet" else "other" for name in picture.features if name in BEHIND}
        found["background"] = dict.fromkeys(behind, frame)
        found["sensor"] = {"pixel": frame, "step": frame * sum(name in COSTLY_STEPS for name in picture.features)}
    return found


def _light(picture: PlannedPicture, options: CommonWork) -> Iterator[tuple[str, float]]:
    """Yield the units of a render, by name: pixels of the region; samples of pixels that show the target, and among
    these samples of glossy surfaces and of surfaces lit by surroundings; and pixels to denoise, for each light
    group."""
    effort = options.effort
    share = 1 / effort.reduction**2
    pixels = picture.region_pixels * share
    samples = expected_samples(effort, glossy="glossy" in picture.features) * share * picture.target_pixels
    yield "pixel", pixels
    yield "sample", samples
    for name in LIT:
        if name in picture.features:
            yield name, samples
    if effort.denoiser != "none":
        yield "denoised high" if effort.denoiser == "high" else "denoised", picture.light_groups * pixels


def expected_samples(effort: Effort, *, glossy: bool) -> float:
    """Return the samples that a pixel takes, on average over the target."""
    if not effort.adaptive:
        return float(effort.samples)
    wanted = ADAPTIVE_SAMPLES * effort.adaptive**ADAPTIVE_POWER if glossy else LOOKS_EVERY
    return min(max(wanted, LOOKS_EVERY), float(effort.samples))
