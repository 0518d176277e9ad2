"""The memory of a run's supervisor and worker as its pictures are made."""

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
from run_trials.supervised_run import SupervisedRun, records

LOOK_S = 0.5
WARM = 0.25  # of the pictures: what is kept for later ones has been filled by then
MB = 1e6


@dataclass(frozen=True, kw_only=True)
class MemorySample:
    """What was held when so many pictures were finished, in MB: by the supervisor, and by its worker (resident set)."""

    pictures: int
    supervisor: float
    worker: float


def sampled(run: SupervisedRun, dataset: Path) -> list[MemorySample]:
    """Return samples of a run with one worker, from its first picture on, until it has ended."""
    found: list[MemorySample] = []
    while run.goes_on:
        pictures, children = records(dataset), run.children()
        if pictures and len(children) == 1 and (not found or found[-1].pictures < pictures):
            with suppress(psutil.Error):
                supervisor = psutil.Process(run.process.pid)
                held = {"supervisor": _held(supervisor), "worker": _held(children[0])}
                if all(held.values()):  # a process that has ended holds nothing
                    found.append(MemorySample(pictures=pictures, **held))
        time.sleep(LOOK_S)
    return found


def _held(process: psutil.Process) -> float:
    return float(process.memory_info().rss / MB)


def slope(samples: Sequence[MemorySample], of: str) -> float:
    """Return MB for 1,000 pictures more: the line of least squares through the samples but the first WARM of them."""
    warm = [sample for sample in samples if sample.pictures >= WARM * samples[-1].pictures]
    line = np.polyfit([sample.pictures for sample in warm], [getattr(sample, of) for sample in warm], 1)
    return float(1000 * line[0])


def in_csv(samples: Sequence[MemorySample]) -> str:
    rows = (f"{sample.pictures},{sample.supervisor:.1f},{sample.worker:.1f}" for sample in samples)
    return "\n".join(["pictures,supervisor_MB,worker_MB", *rows, ""])
