"""The request for a measurement, and what all of its parts share."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from spin_usd.accuracy.measurement import FORMULAS, Measurement
from spin_usd.basics.arrays import digest
from spin_usd.basics.progress import Progress
from spin_usd.commands.measure.calls import MAKE_RUNS, MakeRuns
from spin_usd.commands.measure.options import MeasureOptions
from spin_usd.commands.measure.processes import Processes, ProcessKind
from spin_usd.commands.measure.renders import RenderStore
from spin_usd.errors import SpinError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.scene.effort import Effort

BLENDER, RAYCAST = ProcessKind(renderer="blender"), ProcessKind(renderer="raycast")
OVERHEAD_SAMPLES = 8  # cost of a render besides its samples, in samples
PART = 2  # samples of a part of the reference, over the most samples of a setting
PERCENT = 100


class PercentDone:
    """The share of the work that is done: pieces of work by key; each counts once."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._cost: dict[str, int] = {}
        self._left: set[str] = set()
        self._done = 0

    def expect(self, cost: Mapping[str, int]) -> None:
        new = cost.keys() - self._cost.keys()
        self._cost.update((key, cost[key]) for key in new)
        self._left |= new
        self._report()

    def did(self, keys: Iterable[str]) -> None:
        for key in self._left.intersection(keys):
            self._left.remove(key)
            self._done += self._cost[key]
        self._report()

    def _report(self) -> None:
        self._progress("measuring: percent", PERCENT * self._done // max(sum(self._cost.values()), 1), PERCENT)


@dataclass(frozen=True, kw_only=True)
class Series:
    """Renders of a picture that differ in their seeds alone: made by a process of that kind, and stored by key."""

    kind: ProcessKind
    effort: Effort
    seeds: tuple[int, ...]
    keys: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Campaign:
    """The values that the parts of a measurement share.

    request · runs: the results so far · seed: of the dataset · stage: its hash · versions: of the software · machine:
    the machine that is measured on · processes(count): that number of processes.
    """

    request: MeasureOptions
    runs: RenderStore
    seed: int
    stage: str
    versions: Mapping[str, str]
    machine: Mapping[str, str | int]
    percent_done: PercentDone
    processes: Callable[[int], Processes]

    def measurement(self, **found: Any) -> Measurement:
        """Return the measurement with the results `found`, by the names of Measurement."""
        return Measurement(
            stage=self.stage,
            variant=self.request.variant,
            machine=self.machine,
            versions=self.versions,
            reference_share=self.request.reference_share,
            **found,
        )

    def key(self, *of: Any) -> str:
        """Return the key of a result of `of`, JSON, with this software on this machine."""
        return digest(dict(self.versions), dict(self.machine), list(of))

    def result_key(self, *of: Any) -> str:
        """Return the key of figures from `of`, JSON, by today's formulas."""
        return self.key("formulas", FORMULAS, *of)

    def seeds(self, purpose: str, numbers: range) -> tuple[int, ...]:
        """Return the seeds of renders for this purpose, by number; a dataset's own pictures have other seeds."""
        return tuple(int(digest(["measure", self.seed, purpose, n])[:8], 16) & 0x7FFFFFFF for n in numbers)

    def series(self, picture: PlannedPicture, kind: ProcessKind, effort: Effort, seeds: Sequence[int]) -> Series:
        """Return the renders of the picture with these seeds."""
        how = [picture.radiance, asdict(kind), asdict(effort)]
        keys = tuple(self.key(*how, seed) for seed in seeds)
        return Series(kind=kind, effort=effort, seeds=tuple(seeds), keys=keys)

    def expect(self, picture: PlannedPicture, wanted: Iterable[Series]) -> None:
        """Count expected renders."""
        for series in wanted:
            self.percent_done.expect(dict.fromkeys(series.keys, weight(picture, series.effort)))

    def make(self, processes: Processes, picture: PlannedPicture, wanted: Sequence[Series]) -> list[str | None]:
        """Render the missing parts of the series. Return for each why it failed, None if it is complete."""
        self.expect(picture, wanted)
        failed: dict[int, str] = {}
        for kind in dict.fromkeys(series.kind for series in wanted):
            requests = {}
            for number, series in enumerate(wanted):
                seeds = zip(series.keys, series.seeds, strict=True)
                missing = {key: seed for key, seed in seeds if not self.runs.has(key)}
                self.percent_done.did(set(series.keys) - missing.keys())
                if missing and series.kind == kind:
                    requests[number] = MakeRuns(index=picture.index, effort=series.effort, seeds=missing)
            answers = processes.run(kind, MAKE_RUNS, list(requests.values()), lambda key: self.percent_done.did([key]))
            for number, answer in zip(requests, answers, strict=True):
                self.percent_done.did(wanted[number].keys)  # a failed series counts as done
                if isinstance(answer, SpinError):
                    failed[number] = str(answer)
        return [failed.get(number) for number in range(len(wanted))]


def weight(picture: PlannedPicture, effort: Effort) -> int:
    """Return the approximate cost of a render, in samples of a pixel."""
    return picture.region_pixels * (effort.samples + OVERHEAD_SAMPLES)
