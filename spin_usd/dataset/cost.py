"""What making pictures costs: seconds of one core by kind of work, and bytes. Runs scale what is expected of the next.

Of the constants those of Blender's passes, labels, files and their bytes were measured before renders were shared (2
cores of an x86-64 server, SPEED+ camera, a 23,360-face Tango); those of stage, cache, background, sensor, the ray
caster's pass and cached renders are rough guesses, not measured. What a dataset's own runs took beside what was
expected of them is kept in its `cache/measured.json`, and scales what is expected next.
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

START_S = 3.0  # a worker's start
STAGE_S = 0.002  # reading a picture's scene, and its keys
PASS_S = {"blender": 0.03, "raycast": 0.002}  # what a pass costs beside its pixels
SAMPLE_S = {"blender": 1.25e-6, "raycast": 0.6e-6}  # per sample and pixel of the region, of which half are target
LABEL_PASS_PIXEL_S = 0.6e-6  # per pixel of the region: the ray, the cast
LABEL_PIXEL_S = 0.4e-6  # per pixel of the region: the point, all labels
BACKGROUND_PIXEL_S = 0.5e-8  # of the whole frame
SENSOR_PIXEL_S = 6e-8
FILE_PIXEL_S = 3.5e-8  # of the whole frame, a file: encode, decode again, hash, sync
CACHE_S = 0.001  # look-ups, links
BYTES_PER_REGION_PIXEL = {IMAGE: 0.35, RADIANCE: 6.0, "depth": 1.3, "segmentation": 0.03, "dense_pose": 4.0}
BYTES_PER_FRAME_PIXEL = 0.01  # compressed emptiness
CACHED_RENDER_BYTES = 9.0  # a pixel of the region and light group, of which most stages have one
LEAST_MEASURED_S = 0.05  # of a kind of work, from which it says anything


@dataclass(frozen=True, kw_only=True)
class Making:
    """A picture to make, and which passes it takes of its own: others are in the cache by then."""

    picture: PlannedPicture
    label_pass: bool
    render: bool


@dataclass(frozen=True, kw_only=True)
class Method:
    """How all pictures of a run are made: renderer, samples a pixel, kinds of file, pixels of the whole frame."""

    renderer: str
    samples: int
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
    region, frame = making.picture.region_pixels, method.frame_pixels
    files = sum(making.label_pass or kind not in LABELS for kind in method.kinds)
    work = {"stage": STAGE_S, "cache": CACHE_S, "files": FILE_PIXEL_S * frame * files}
    if making.label_pass:
        work["label pass"] = PASS_S[method.renderer] + LABEL_PASS_PIXEL_S * region
        work["labels"] = LABEL_PIXEL_S * region
    if making.render:
        work["beauty pass"] = PASS_S[method.renderer] + SAMPLE_S[method.renderer] * region * method.samples
    if IMAGE in method.kinds:
        work["background"] = BACKGROUND_PIXEL_S * frame
        work["sensor"] = SENSOR_PIXEL_S * frame
    return work


def expected_bytes(making: Making, method: Method) -> float:
    """On disk; labels that another picture's file holds already take none."""
    region, frame = making.picture.region_pixels, method.frame_pixels
    kinds = [kind for kind in method.kinds if making.label_pass or kind not in LABELS]
    size = sum(region * BYTES_PER_REGION_PIXEL[kind] + frame * BYTES_PER_FRAME_PIXEL for kind in kinds)
    return size + (region * CACHED_RENDER_BYTES if making.render else 0)


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
