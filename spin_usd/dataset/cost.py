"""What making pictures costs: seconds of one core by kind of work, and bytes. Runs scale what is expected of the next.

The constants were measured on one core of a 2-core x86-64 server: four Sunlamp poses of Tango, 1920x1200, 1 and 17
samples; `relight` over them; background and sensor each alone. Groups of lights cost nothing that could be measured. A
dome is taken for a back plate, unmeasured.
What a dataset's own runs took beside what was expected of them is kept in its `cache/measured.json`, and scales what is
expected next.
"""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path

from spin_usd.dataset.job import PlannedPicture
from spin_usd.dataset.picture import IMAGE, RADIANCE
from spin_usd.dataset.store import write_json
from spin_usd.labels.label import LABELS
from spin_usd.scene.effort import Effort
from spin_usd.scene.light import DomeLight
from spin_usd.scene.model import Scene

START_S = 2.6  # a worker's start
OPEN_S = 0.2  # a variant's stage
STAGE_S = 0.002  # reading a picture's scene, and its keys
LABEL_PASS_S, LABEL_PASS_PIXEL_S = 0.03, {"blender": 0.6e-6, "raycast": 0.35e-6}  # a pass, a pixel of the region
LABEL_PIXEL_S = 0.4e-6  # per pixel of the region: the point, all labels
RENDER_S = 0.1
SAMPLE_S = {"blender": 1.25e-6, "raycast": 0.75e-6}  # per sample and pixel of the region, of which half are target
SENSOR_PIXEL_S = 2e-8  # of the whole frame
FEATURE_PIXEL_S = {
    "planet": 1.5e-7,
    "stars": 1e-8,
    "back plate": 4e-8,
    "dome": 4e-8,
    "vignetting": 2e-9,
    "spread": 2e-9,
    "glare": 3.2e-8,
    "bloom": 2e-8,
    "noise": 2.5e-8,
}
"""Seconds a pixel of the whole frame, by what lies behind the target and what optics and detector do."""
BEHIND = ("planet", "stars", "back plate", "dome")
FILE_PIXEL_S = 3.3e-8  # of the whole frame, a file: encode, decode again, hash, sync
CACHE_S, CACHE_PIXEL_S = 0.001, 6.5e-8  # look-ups and links; a pixel of the region of a render that is read
BYTES_PER_REGION_PIXEL = {IMAGE: 0.35, RADIANCE: 6.0, "depth": 1.3, "segmentation": 0.03, "dense_pose": 4.0}
BYTES_PER_FRAME_PIXEL = 0.01  # compressed emptiness
NOISE_BYTES = 0.45  # a pixel of the whole frame, of an image with a detector's noise
CACHED_CHANNEL_BYTES = 1.5  # a pixel of the region
LEAST_MEASURED_S = 0.05  # of a kind of work, from which it says anything


def features(scene: Scene) -> list[str]:
    """What of the scene's background, optics and detector costs, by its names in FEATURE_PIXEL_S."""
    behind, optics, sensor = scene.environment, scene.optics, scene.sensor
    has = {
        "planet": bool(behind.planets),
        "stars": bool(behind.stars),
        "back plate": behind.back_plate is not None,
        "dome": any(isinstance(light, DomeLight) for light in scene.lights),
        "vignetting": optics.cos_fourth or any(optics.vignetting),
        "spread": optics.psf_sigma > 0,
        "glare": optics.glare > 0,
        "bloom": optics.bloom_intensity > 0,
        "noise": sensor.gain > 0,
    }
    return [name for name, there in has.items() if there]


@dataclass(frozen=True, kw_only=True)
class Making:
    """A picture to make, and which passes it takes of its own: others are in the cache by then."""

    picture: PlannedPicture
    label_pass: bool
    render: bool


@dataclass(frozen=True, kw_only=True)
class Method:
    """How all pictures of a run are made: renderer, effort, kinds of file, pixels of the whole frame."""

    renderer: str
    effort: Effort
    kinds: tuple[str, ...]
    frame_pixels: int

    @property
    def labels(self) -> tuple[str, ...]:
        return tuple(kind for kind in self.kinds if kind in LABELS)

    @property
    def lit(self) -> bool:
        """Whether pictures show the target's light, and so take a render."""
        return IMAGE in self.kinds or RADIANCE in self.kinds


def expected_work(making: Making, method: Method) -> dict[str, float]:
    """Seconds of one core by kind of work, by the names that workers report."""
    picture, frame = making.picture, method.frame_pixels
    region = picture.region_pixels
    files = sum(making.label_pass or kind not in LABELS for kind in method.kinds)
    work = {"stage": STAGE_S, "cache": CACHE_S, "files": FILE_PIXEL_S * frame * files}
    if making.label_pass:
        work["label pass"] = LABEL_PASS_S + LABEL_PASS_PIXEL_S[method.renderer] * region
        work["labels"] = LABEL_PIXEL_S * region
    if making.render:
        work["beauty pass"] = RENDER_S + SAMPLE_S[method.renderer] * region * method.effort.samples
    elif method.lit:
        work["cache"] += CACHE_PIXEL_S * region
    if IMAGE in method.kinds:
        costs = {name: FEATURE_PIXEL_S[name] * frame for name in picture.features}
        work["background"] = sum(seconds for name, seconds in costs.items() if name in BEHIND)
        work["sensor"] = SENSOR_PIXEL_S * frame + sum(costs.values()) - work["background"]
    return work


def expected_bytes(making: Making, method: Method) -> float:
    """On disk; labels that another picture's file holds already take none."""
    region, frame = making.picture.region_pixels, method.frame_pixels
    kinds = [kind for kind in method.kinds if making.label_pass or kind not in LABELS]
    size = sum(region * BYTES_PER_REGION_PIXEL[kind] + frame * BYTES_PER_FRAME_PIXEL for kind in kinds)
    if "noise" in making.picture.features and IMAGE in kinds:
        size += frame * NOISE_BYTES
    channels = 3 * making.picture.light_groups + 1
    return size + (region * channels * CACHED_CHANNEL_BYTES if making.render else 0)


@dataclass(kw_only=True)
class Measured:
    """Seconds of one core by kind of work: what was expected of a dataset's runs, and what they took."""

    expected: dict[str, float] = field(default_factory=dict)
    taken: dict[str, float] = field(default_factory=dict)

    def add(self, expected: Mapping[str, float], taken: Mapping[str, float]) -> None:
        """Note a picture."""
        for sums, more in ((self.expected, expected), (self.taken, taken)):
            for work, seconds in more.items():
                sums[work] = sums.get(work, 0.0) + seconds

    def scaled(self, work: Mapping[str, float]) -> dict[str, float]:
        """`work` as expected, each kind times what it took of what was expected of it."""
        return {kind: seconds * self._scale(kind) for kind, seconds in work.items()}

    def _scale(self, work: str) -> float:
        expected = self.expected.get(work, 0.0)
        return self.taken.get(work, 0.0) / expected if expected >= LEAST_MEASURED_S else 1.0


def read_measured(file: Path) -> Measured:
    """What `write_measured` wrote; nothing where that is not there or damaged."""
    with suppress(OSError, ValueError, TypeError, AttributeError, KeyError):
        values = json.loads(file.read_text(encoding="utf-8"))
        parts = [{str(work): float(s) for work, s in values[name].items()} for name in ("expected", "taken")]
        if all(0 <= seconds < float("inf") for part in parts for seconds in part.values()):
            return Measured(expected=parts[0], taken=parts[1])
    return Measured()


def write_measured(file: Path, of_run: Measured) -> None:
    """Add what a run measured to what is kept."""
    kept = read_measured(file)
    kept.add(of_run.expected, of_run.taken)
    write_json(file, asdict(kept))
