"""The processors that this process may use, and how workers share them; the machine in a few words."""

import os
import platform
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from math import ceil
from pathlib import Path
from zlib import crc32

from spin_usd.processes.control_groups import group_limits

CPU_INFO = Path("/proc/cpuinfo")
MODEL = {"vendor_id", "cpu family", "model", "model name", "stepping", "CPU implementer", "CPU part"}


def usable_cpus() -> list[int]:
    """Return the processors this process may use, as many as the time that its control groups allow it."""
    if not hasattr(os, "sched_getaffinity"):
        return list(range(os.cpu_count() or 1))
    cpus = sorted(os.sched_getaffinity(0))
    count = min([len(cpus), *(max(ceil(quota), 1) for quota in _quotas())])
    if count == len(cpus):
        return cpus
    start = crc32(platform.node().encode()) % len(cpus)  # else all containers of a machine would use the first ones
    return sorted((cpus * 2)[start : start + count])


def _quotas() -> Iterator[float]:
    """Yield the processors' time per time that each control group that holds us may use."""
    for words in group_limits("cpu", ["cpu.cfs_quota_us", "cpu.cfs_period_us"], "cpu.max"):
        with suppress(ValueError):  # "max" for no limit
            quota, period = map(int, words)
            if quota > 0:  # -1 for no limit
                yield quota / period


def share_of(number: int, count: int) -> list[int]:
    """Return the processors of the `number`th of `count` workers: equal shares, which overlap if there are more workers
    than processors."""
    cpus = usable_cpus()
    share = max(len(cpus) // count, 1)
    return [cpus[(number * share + i) % len(cpus)] for i in range(share)]


def hold_to(cpus: Sequence[int]) -> None:
    """Let this process, all its threads, and its later children use these processors alone, where the system can:
    Blender's own limit of threads burns a second core."""
    import psutil  # not above: it is slow to load, and the command line needs this file

    if sys.platform == "linux":
        for thread in psutil.Process().threads():
            with suppress(ProcessLookupError):  # it has ended meanwhile
                os.sched_setaffinity(thread.id, cpus)


def processor_model() -> str:
    """Return the system's description of the first processor."""
    with suppress(OSError):
        pairs = [line.partition(":") for line in CPU_INFO.read_text().partition("\n\n")[0].splitlines()]
        return ", ".join(value.strip() for name, _, value in pairs if name.strip() in MODEL)
    return platform.processor()  # not Linux


def machine() -> dict[str, str | int]:
    """Return the number of processors that may be used, the architecture, the system, and the memory in GiB:
    the machine that figures were measured on, without names or paths."""
    import psutil

    return {
        "cores": len(usable_cpus()),
        "architecture": platform.machine(),
        "system": platform.system(),
        "memory_gib": round(psutil.virtual_memory().total / 2**30),
    }
