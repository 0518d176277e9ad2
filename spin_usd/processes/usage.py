"""The processor usage of a child process and its descendants: how long they ran, and how long they could have run and
did not.

On a busy machine the clock does not measure a process. Linux keeps for each thread how long it ran and how long it was
ready and waited for a processor. Source: proc(5), /proc/pid/task/tid/schedstat, in nanoseconds. macOS keeps only the
processor time of a process: there the time in which it did not run counts as idle by the share of it that the
load of the machine left.
"""

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

NANOSECOND = 1e-9
TICK_S = 1 / os.sysconf("SC_CLK_TCK")
LONGEST_LOOK_S = 2.0  # most idle time that a look counts: in more, we slept or had no processor ourselves
FULL = 0.9  # of the time since the last look: if a thread ran so much, others need no look
DISK_SHARE = 0.1  # of waiting for a disk that counts as idle: a file server may take minutes, but not for ever
RUNNABLE, DISK, STOPPED, TRACED = "R", "D", "T", "t"  # proc(5), /proc/pid/stat, state

Thread = tuple[int, int]  # the ids of a process and of one of its threads


@dataclass(frozen=True, kw_only=True)
class Usage:
    """The usage of a process and its descendants while they were looked at, in seconds."""

    busy_s: float = 0.0
    """Processor time of the busiest thread at each time. On a free machine it is the clock's, however many threads
    there are."""
    idle_s: float = 0.0
    """Time in which none of them ran, waited for a processor or was stopped."""
    stopped_s: float = 0.0
    """Time in which they were stopped (SIGSTOP)."""

    def since(self, before: "Usage") -> "Usage":
        """Return the usage since `before`."""
        return Usage(
            busy_s=self.busy_s - before.busy_s,
            idle_s=self.idle_s - before.idle_s,
            stopped_s=self.stopped_s - before.stopped_s,
        )


class UsageMeter:
    """Adds up the usage of the process `pid` from one look to the next."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._usage = Usage()
        self._looked: float | None = None
        self._threads: Mapping[Thread, tuple[float, float]] = {}
        self._processor_s = 0.0

    def look(self) -> Usage:
        """Look at the process, and return its usage since the first look."""
        now = time.monotonic()
        since = 0.0 if self._looked is None else now - self._looked
        with suppress(OSError, psutil.Error, ValueError, IndexError):  # it has ended, which its answers report
            busy, idle, stopped = self._added(since)
            if self._looked is not None:
                before = self._usage
                self._usage = Usage(
                    busy_s=before.busy_s + busy, idle_s=before.idle_s + idle, stopped_s=before.stopped_s + stopped
                )
            self._looked = now
        return self._usage

    def _added(self, since: float) -> tuple[float, float, float]:
        """Return busy, idle and stopped seconds of the last `since` seconds."""
        if not Path(f"/proc/{self.pid}/schedstat").exists():
            return self._added_without_threads(since)
        processor_s = _processor_seconds(self.pid)
        all_processors, self._processor_s = processor_s - self._processor_s, processor_s
        threads = dict(_threads(self.pid))
        ran, waited = self._since_last(threads, since)
        if max(ran, default=0.0) < FULL * since:
            for process in _descendants(self.pid):
                threads.update(_threads(process))
            ran, waited = self._since_last(threads, since)
        self._threads = threads
        busy = max(all_processors / (os.cpu_count() or 1), *ran, 0.0)  # threads may have come and gone meanwhile
        return min(busy, since), *_idle(threads, since - sum(ran) - sum(waited))

    def _since_last(
        self, threads: Mapping[Thread, tuple[float, float]], since: float
    ) -> tuple[list[float], list[float]]:
        """Return how long each thread ran and waited in the last `since` seconds."""
        pairs = [(now, self._threads.get(thread, (0.0, 0.0))) for thread, now in threads.items()]
        return [min(now[0] - last[0], since) for now, last in pairs], [now[1] - last[1] for now, last in pairs]

    def _added_without_threads(self, since: float) -> tuple[float, float, float]:
        root = psutil.Process(self.pid)
        times = [process.cpu_times() for process in (root, *root.children(recursive=True))]
        processor_s = sum(each.user + each.system for each in times)
        ran, self._processor_s = processor_s - self._processor_s, processor_s
        busy = min(max(ran, 0.0), since)
        if root.status() == psutil.STATUS_STOPPED:
            return busy, 0.0, since - busy
        left = min(1.0, (os.cpu_count() or 1) / max(os.getloadavg()[0], 1.0))
        return busy, left * min(since - busy, LONGEST_LOOK_S), 0.0


def _idle(threads: Mapping[Thread, object], unused: float) -> tuple[float, float]:
    """Return of the seconds in which no thread ran or had waited for a processor those in which they were idle, and
    those in which they were stopped, by the states of the threads now."""
    if unused <= 0:
        return 0.0, 0.0
    states = set(_states(threads))
    if states <= {STOPPED, TRACED}:
        return 0.0, unused
    if RUNNABLE in states:  # it waits for a processor now: its waiting is written down when it has one
        return 0.0, 0.0
    return min(unused, LONGEST_LOOK_S) * (DISK_SHARE if DISK in states else 1.0), 0.0


def _threads(process: int) -> Iterator[tuple[Thread, tuple[float, float]]]:
    """Yield the threads of a process, with the seconds that each ran and waited for a processor."""
    for name in os.listdir(f"/proc/{process}/task"):
        with suppress(OSError):
            ran, waited, _ = _words(f"/proc/{process}/task/{name}/schedstat")
            yield (process, int(name)), (int(ran) * NANOSECOND, int(waited) * NANOSECOND)


def _descendants(process: int) -> Iterator[int]:
    """Yield the children of this process, and theirs."""
    for name in os.listdir(f"/proc/{process}/task"):
        with suppress(OSError):  # a kernel may be made without this file
            for child in _words(f"/proc/{process}/task/{name}/children"):
                yield int(child)
                yield from _descendants(int(child))


def _states(threads: Mapping[Thread, object]) -> Iterator[str]:
    for process, thread in threads:
        with suppress(OSError):
            yield _fields(f"/proc/{process}/task/{thread}/stat")[0]


def _processor_seconds(process: int) -> float:
    """Return the processor time of a process, and of its children that have ended."""
    return sum(map(int, _fields(f"/proc/{process}/stat")[11:15])) * TICK_S


def _fields(path: str) -> list[str]:
    """Return the fields of a file `stat` from the state on: the name before it may contain anything."""
    return Path(path).read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()


def _words(path: str) -> list[str]:
    return Path(path).read_text(encoding="ascii").split()
