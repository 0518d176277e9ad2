"""Runs on full and read-only disks, beside another run, and under limits of the system; and what comes of them."""

import os
import random
import resource
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from run_trials.comparison import digests, faults, torn
from run_trials.supervised_run import SupervisedRun

SAID = (0, 1, 2)  # exit codes of what a user can mend
MIN_DISK, STEP = 200_000, 60_000  # bytes that a disk has at first, and gets more at most
MEMORY = (1 << 28, 1 << 34)  # bytes of address space, least and most
FILES = (4, 256)


@dataclass(kw_only=True)
class LimitTrial:
    """A trial over one stage. how: the runs' options · counts, faults: what came of it · whole: digests of the dataset
    that the others must be equal to."""

    stage: Path
    out: Path
    pictures: int
    how: tuple[object, ...]
    chance: random.Random
    counts: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    whole: dict[str, str] = field(default_factory=dict)

    def make_whole(self) -> None:
        self._ended(self._start(self.out / "whole"), "undisturbed", self.out / "whole")
        self.whole = digests(self.out / "whole")

    def full_disk(self, times: int) -> None:
        """Run on a disk that is full, give it a little more, and so on, until it was full so often."""
        while self.counts["full disk: exit code 2"] < times:
            with _disk(self.out / "disk", MIN_DISK) as disk:
                size, code = MIN_DISK, 2
                while code and self.counts["full disk: exit code 2"] < times:
                    code = self._ended(self._start(disk / "dataset"), "full disk", disk / "dataset")
                    size += self.chance.randrange(4096, STEP)
                    _remount(disk, f"size={size}")
                _remount(disk, "size=1g")
                self._completed(disk / "dataset")

    def read_only(self) -> None:
        """Run on a disk that became read-only half-way."""
        with _disk(self.out / "disk", 1 << 30) as disk:
            self._ended(self._start(disk / "dataset", "--frames", "0:1"), "half", disk / "dataset")
            _remount(disk, "ro")
            self._ended(self._start(disk / "dataset"), "read-only disk", disk / "dataset", swept=False)
            self._ended(self._start(disk / "another"), "read-only disk", disk / "another")
            _remount(disk, "rw")
            self._completed(disk / "dataset")

    def two_at_once(self, times: int) -> None:
        """Run twice at the same time into one folder."""
        for number in range(times):
            dataset = self.out / f"two{number}"
            first = self._start(dataset)
            time.sleep(self.chance.uniform(0, 2))
            second = self._start(dataset)
            self._ended(second, "the second of two", dataset, swept=False)
            self._ended(first, "the first of two", dataset)
            self._completed(dataset)

    def limited(self, what: str, limit: int, between: tuple[int, int], times: int) -> None:
        """Run under a limit of setrlimit(2), so often, each time another."""
        for number in range(times):
            value, dataset = self._between(*between), self.out / f"{what.replace(' ', '_')}{number}"
            run = self._start(dataset, preexec_fn=partial(resource.setrlimit, limit, (value, value)))
            self._ended(run, what, dataset)
            self._completed(dataset)

    def all_limits(self, times: int) -> None:
        largest = max(path.stat().st_size for path in (self.out / "whole").rglob("*") if path.is_file())
        self.limited("bounded files", resource.RLIMIT_FSIZE, (1, largest), times)
        self.limited("ulimit -v", resource.RLIMIT_AS, MEMORY, times)
        self.limited("ulimit -n", resource.RLIMIT_NOFILE, FILES, times)

    def table(self) -> str:
        """Return what came of it as Markdown."""
        lines = ["| what | how often |", "| --- | ---: |"]
        lines += [f"| {what} | {count:,} |" for what, count in sorted(self.counts.items())]
        return "\n".join([*lines, f"| did not hold | {len(self.faults)} |", *(f"- {each}" for each in self.faults)])

    def _between(self, low: int, high: int) -> int:
        """Return a number between these, as often near the least as near the most of them by their digits."""
        return int(low * (high / low) ** self.chance.random())

    def _start(self, dataset: Path, *more: object, preexec_fn: Callable[[], None] | None = None) -> SupervisedRun:
        words = ("render", self.stage, "--out", dataset, *self.how, *more)
        return SupervisedRun(*words, preexec_fn=preexec_fn)

    def _ended(self, run: SupervisedRun, what: str, dataset: Path, *, swept: bool = True) -> int:
        """Wait for the end of a run, look at what it left, and return its exit code."""
        while run.goes_on:
            run.children()
            time.sleep(0.05)
        self.counts[f"{what}: exit code {run.wait()}"] += 1
        self.faults += [f"{what}: {fault}" for fault in self._faults(run, dataset, swept=swept)]
        return run.wait()

    def _faults(self, run: SupervisedRun, dataset: Path, *, swept: bool) -> Iterator[str]:
        said = run.said()
        if run.wait() not in SAID or "Traceback" in said or "internal error" in said:
            yield f"exit code {run.wait()}: {said.strip()}"
        yield from (f"process {pid} is left" for pid in run.left())
        yield from torn(dataset)
        if swept and dataset.is_dir():
            yield from (f"{path.name} is left" for path in dataset.iterdir() if path.name.startswith("."))

    def _completed(self, dataset: Path) -> None:
        """Run once more without any trouble: the dataset must be whole then."""
        run = self._start(dataset)
        if self._ended(run, "completed", dataset):
            self.faults.append(f"{dataset.name}: {run.said().strip()}")
        self.faults += faults(dataset, self.whole, pictures=self.pictures)


def can_mount() -> bool:
    """Return whether a small disk can be made here, which only root may."""
    return os.geteuid() == 0


@contextmanager
def _disk(place: Path, size: int) -> Iterator[Path]:
    """Give a disk of so many bytes, in memory."""
    place.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "none", str(place)], check=True)
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def _remount(disk: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", str(disk)], check=True)
