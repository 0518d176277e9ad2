"""Ways to render all pictures of a measurement, timed: one process or several, with the crop and without."""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from msgspec import to_builtins

from spin_usd.accuracy.measurement import Execution, Failure
from spin_usd.accuracy.sweep import base_effort
from spin_usd.commands.measure.calls import RENDER_DIGEST, RenderOnce
from spin_usd.commands.measure.campaign import Campaign, weight
from spin_usd.commands.measure.processes import ProcessKind
from spin_usd.errors import SpinError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.processes.processors import usable_cpus


@dataclass(frozen=True, kw_only=True)
class ExecutionMode:
    """A way to render: a number of processes that share the processors, with or without the crop to the target."""

    processes: int
    crop: bool

    @property
    def threads(self) -> int:
        return max(len(usable_cpus()) // self.processes, 1)


class ExecutionTask:
    """All pictures of a measurement, with each seed, rendered in each of the ways."""

    def __init__(self, campaign: Campaign, pictures: Sequence[PlannedPicture]) -> None:
        self._campaign = campaign
        effort, seeds = (
            base_effort(campaign.request.max_samples),
            campaign.seeds("setting", range(campaign.request.seeds)),
        )
        ordered = sorted(pictures, key=lambda each: -each.region_pixels)  # the long ones first: no process waits
        self._largest = ordered[0].frame
        self._renders = [
            RenderOnce(index=picture.index, effort=effort, seed=seed) for picture in ordered for seed in seeds
        ]
        ways = (
            ExecutionMode(processes=n, crop=crop) for n, crop in ((1, True), (len(usable_cpus()), True), (1, False))
        )
        radiance = [picture.radiance for picture in ordered]
        renders = to_builtins(self._renders)
        self._keys = {way: campaign.result_key("execution", asdict(way), radiance, renders) for way in ways}
        campaign.percent_done.expect(
            dict.fromkeys(self._keys.values(), len(seeds) * sum(weight(picture, effort) for picture in ordered))
        )

    @property
    def keys(self) -> set[str]:
        """Keys of all its stored results."""
        return set(self._keys.values())

    def measured(self) -> tuple[tuple[Execution, ...], tuple[Failure, ...]]:
        """Return the times of each way, and the ways that failed."""
        made, failures = {}, []
        for way, key in self._keys.items():
            known = self._campaign.runs.known(key) or self._run(way)
            self._campaign.percent_done.did([key])
            if "failed" in known:
                what = f"{way.processes} processes of {way.threads} threads{'' if way.crop else ' without the crop'}"
                failures.append(Failure(frame=self._largest, what=what, reason=known["failed"]))
            else:
                self._campaign.runs.write_result(key, known)
                made[way] = known
        first = next(iter(made.values()), {})
        executions = (
            Execution(
                processes=way.processes,
                threads=way.threads,
                crop=way.crop,
                wall_s=each["wall_s"],
                same=each["digests"] == first["digests"],
            )
            for way, each in made.items()
        )
        return tuple(executions), tuple(failures)

    def _run(self, way: ExecutionMode) -> dict[str, Any]:
        """Render in that way. Return seconds of wall clock and each render's digest, or why it failed."""
        kind = ProcessKind(renderer="blender", crop=way.crop)
        with self._campaign.processes(way.processes) as processes:
            processes.run(kind, RENDER_DIGEST, self._renders[-1:] * way.processes)  # opens each process
            began = time.perf_counter()
            answers = processes.run(kind, RENDER_DIGEST, self._renders)
            wall_s = time.perf_counter() - began
        failed = [str(answer) for answer in answers if isinstance(answer, SpinError)]
        return {"failed": failed[0]} if failed else {"wall_s": wall_s, "digests": answers}
