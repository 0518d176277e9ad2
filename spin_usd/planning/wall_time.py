"""Estimate the time of a run from the work of its pictures: the start, and workers that each take the next picture.

The constants were measured on a 2-core x86-64 server.
"""

import heapq
from collections.abc import Iterable, Mapping
from functools import lru_cache

from spin_usd.picture.kinds import BEAUTY_PASS
from spin_usd.planning.make_plan import sharing
from spin_usd.planning.work import Work

PLANNING_S = 1.4  # to open the stage in a process of its own
PLANNED_S = 6e-4  # a picture, by one of the planning processes
START_S = 2.4  # a worker's start, and the additional time of its first picture
OPEN_S = 0.2  # a variant's stage, in each worker
DEVICE_ALONE = 0.5  # of a render's time on a device, without another worker's render there (measured)
SPEED_UP = 0.9  # power of the number of cores by which the renders of one worker are faster


def wall_seconds(
    works: Iterable[Work],
    *,
    planned: int,
    variants: int,
    workers: int,
    cores: int,
    slower: float = 1.0,
) -> float:
    """Return the seconds of a run that plans `planned` pictures of the `variants`, and makes those with the `works`, in
    their order.

    `slower`: factor by which this machine is slower than the one of the constants. 0 without works.
    """
    listed = list(works)
    if not listed:
        return 0.0
    count = min(workers, len(listed))
    ends = [0.0] * count
    for work in listed:
        heapq.heapreplace(ends, ends[0] + worker_seconds(work, workers=count, cores=cores))
    planning = PLANNING_S + PLANNED_S * planned / sharing(planned, cores)
    shared = DEVICE_ALONE * sum(work.device for work in listed)
    return slower * (planning + START_S + OPEN_S * variants) + max(shared, *ends)


def worker_seconds(work: Work, *, workers: int, cores: int) -> float:
    """Return the wall-clock seconds that the work takes one of the workers."""
    return _pace(workers, cores)[1] * thread_seconds(work, workers=workers, cores=cores)


def thread_seconds(work: Work, *, workers: int, cores: int) -> float:
    """Return the processor seconds that the work takes the busiest thread of one of the workers."""
    return work.render / _pace(workers, cores)[0] + work.rest + work.device


def one_core(taken: Mapping[str, float], *, workers: int, cores: int) -> dict[str, float]:
    """Return the work, in seconds of one core by kind, that took one of the workers so long."""
    faster, slower = _pace(workers, cores)
    return {kind: seconds * (faster if kind == BEAUTY_PASS else 1.0) / slower for kind, seconds in taken.items()}


@lru_cache(maxsize=1)
def _pace(workers: int, cores: int) -> tuple[float, float]:
    """Return how many times faster the renders of each of the workers are than on one core, and how many times
    slower all its work is."""
    slower = max(workers / cores, 1.0)
    return max(cores // workers, 1) ** SPEED_UP, slower
