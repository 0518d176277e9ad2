"""The cost of making pictures: seconds of one core by kind of work, and bytes.

Runs scale the later estimates. The constants are few and rough, measured on one core of a 2-core x86-64 server, and
scaled by how many times slower this machine is (`machine_speed`). Times of a dataset's own runs, with their estimates,
are kept in its `cache/measured.json`, and scale later estimates in place of this.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path

from spin_usd.basics.json_fields import Size
from spin_usd.basics.nesting import typed_json
from spin_usd.errors import InputError
from spin_usd.files.folder import Folder
from spin_usd.files.size_limits import MAX_SPECIFICATION
from spin_usd.labels.table import LABELS
from spin_usd.picture.kinds import BEAM_PASS, BEAUTY_PASS, DEVICE_PASS, IMAGE, LABEL_PASS, RADIANCE
from spin_usd.planning.work import CommonWork, PictureWork, work_units
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.store.atomic import write_json

Costs = Mapping[str, Mapping[str, float]]
_OF_LABELS = {name: label.target_s for name, label in LABELS.items() if label.target_s}
EVERYWHERE: Costs = {
    "stage": {"picture": 0.0015},
    "cache": {"picture": 0.0005, "pixel": 6.5e-8},
    "files": {"pixel": 5e-9},
    "labels": {"pixel": 5e-8, "target": 2.5e-7, **_OF_LABELS},
    "facts": {"picture": 0.04},
    LABEL_PASS: {"picture": 0.005, "pixel": 1.4e-7},
    BEAM_PASS: {"picture": 0.03},
    "background": {"planet": 1.4e-7, "other": 4e-8},
    "sensor": {"pixel": 2e-8, "step": 2.8e-8},
}
"""Seconds a unit of each kind of work; see work_units."""
BYTES_PER_REGION_PIXEL = {IMAGE: 0.35, RADIANCE: 6.0} | {name: label.file_bytes for name, label in LABELS.items()}
BYTES_PER_FRAME_PIXEL = 0.01  # compressed emptiness
NOISE_BYTES = 0.45  # a pixel of the whole frame, of an image with a detector's noise
CACHED_CHANNEL_BYTES = 1.5  # a pixel of the region
MIN_MEASURED_S = 0.05  # of a kind of work, from which its time counts


def tracing_costs(renderer: str) -> Costs:
    """Return seconds a unit of a render by the renderer `renderer`."""
    entry = renderer_entry(renderer)
    return {BEAUTY_PASS: entry.image_costs, DEVICE_PASS: entry.device_costs}


def expected_work(task: PictureWork, options: CommonWork) -> dict[str, float]:
    """Return seconds of one core by kind of work."""
    costs = {**EVERYWHERE, **tracing_costs(options.renderer)}
    return {
        work: sum(costs[work].get(unit, 0.0) * count for unit, count in units.items())
        for work, units in work_units(task, options).items()
    }


def expected_bytes(task: PictureWork, options: CommonWork) -> float:
    """Return the bytes on disk; labels that another picture's file holds already take none."""
    region, frame = task.picture.region_pixels, options.frame_pixels
    kinds = [kind for kind in options.kinds if task.label_pass or kind not in LABELS]
    size = sum(region * BYTES_PER_REGION_PIXEL[kind] + frame * BYTES_PER_FRAME_PIXEL for kind in kinds)
    if "noise" in task.picture.features and IMAGE in kinds:
        size += frame * NOISE_BYTES
    channels = 3 * task.picture.light_groups + 1
    return size + (region * channels * CACHED_CHANNEL_BYTES if task.render else 0)


@dataclass(kw_only=True)
class Timings:
    """Seconds of one core by kind of work: expected and measured, of a dataset's runs."""

    expected: dict[str, Size] = field(default_factory=dict)
    taken: dict[str, Size] = field(default_factory=dict)

    def add(self, expected: Mapping[str, float], taken: Mapping[str, float]) -> None:
        """Add the expected and the measured seconds of a picture."""
        for sums, more in ((self.expected, expected), (self.taken, taken)):
            for work, seconds in more.items():
                sums[work] = sums.get(work, 0.0) + seconds

    def scaled(self, work: Mapping[str, float], slower: float = 1.0) -> dict[str, float]:
        """Return `work` as expected: each kind times its ratio of measured to expected seconds; a kind without
        measurement takes this machine `slower` times as long."""
        return {kind: seconds * self._scale(kind, slower) for kind, seconds in work.items()}

    def has_measured(self, work: str) -> bool:
        """Return whether enough of that kind of work was measured."""
        return self.expected.get(work, 0.0) >= MIN_MEASURED_S

    def _scale(self, work: str, slower: float) -> float:
        return self.taken.get(work, 0.0) / self.expected[work] if self.has_measured(work) else slower


def read_measured(folder: Folder, name: str) -> Timings:
    """Read the file of `write_measured`; nothing if it is missing or damaged."""
    with suppress(InputError, ValueError):
        return typed_json(folder.read(name, MAX_SPECIFICATION), Timings)
    return Timings()


def write_measured(folder: Folder, name: str, of_run: Timings, *, work: Path) -> None:
    """Add the measurements of a run to the file."""
    kept = read_measured(folder, name)
    kept.add(of_run.expected, of_run.taken)
    write_json(folder, name, asdict(kept), work=work)
