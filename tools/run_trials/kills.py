"""Runs that are killed at random, and what comes of them."""

import random
import signal
import statistics
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil
from run_trials.comparison import digests, faults
from run_trials.supervised_run import SupervisedRun, records

from spin_usd.processes.deaths import TRIES, DeathCause

LOOK_S = 0.02
STOPPED_S = 60.0
GIVEN_UP = f"SIGKILL (perhaps the system was out of memory), {TRIES[DeathCause.KILLED]} times"


@dataclass(kw_only=True)
class KillTrial:
    """A trial over one stage. how: the runs' options · every_s: seconds between kills, on average · the others are
    what was found: counts, seconds until a stopped worker was replaced, and what did not hold."""

    stage: Path
    out: Path
    pictures: int
    how: tuple[object, ...]
    every_s: float
    chance: random.Random
    counts: Counter[str] = field(default_factory=Counter)
    seconds: dict[str, list[float]] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    whole: dict[str, str] = field(default_factory=dict)

    def make_whole(self) -> None:
        """Make the dataset that the others must be equal to."""
        began = time.monotonic()
        run = self._start(self.out / "whole")
        self._end(run, self.out / "whole")
        self.whole = digests(self.out / "whole")
        self.seconds["a run undisturbed"] = [time.monotonic() - began]

    def kill_children(self, kills: int) -> None:
        """Kill so many children at least, of as many runs as that takes. A run gives up, and is run again, where the
        same work was killed as often as runs forgive."""
        while self._killed("planning", "rendering") < kills:
            dataset = self._fresh("children")
            while self._killed_at(run := self._start(dataset), dataset):
                self.counts["runs that gave up"] += 1
                self.faults += [f"{dataset.name}: process {pid} is left" for pid in run.left()]
            self._end(run, dataset)

    def _killed_at(self, run: SupervisedRun, dataset: Path) -> bool:
        """Kill children of the run until it has ended; return whether it gave up for that."""
        while self._wait(run):
            if (children := run.children()) and run.goes_on:
                self._kill(self.chance.choice(children), "rendering" if records(dataset) else "planning")
        return run.wait() == 1 and GIVEN_UP in run.said()

    def kill_supervisors(self, kills: int) -> None:
        """Kill so many supervisors; each dataset is taken up by the next until it is whole."""
        while self._killed("supervisor") < kills:
            dataset = self._fresh("supervisors")
            run = self._start(dataset)
            while self._killed("supervisor") < kills and self._wait(run):
                run.children()
                self._kill(psutil.Process(run.process.pid), "supervisor")
                run.wait()
                self.faults += [f"process {pid} is left" for pid in run.left()]
                run = self._start(dataset)
            self._end(run, dataset)

    def stop_workers(self, stops: int, picture_timeout: float | None) -> None:
        """Stop so many workers, each of another run, for longer than a picture may take, and let them go on."""
        more = ("--picture-timeout", picture_timeout) if picture_timeout else ()
        for _ in range(stops):
            dataset = self._fresh("stopped")
            run = self._start(dataset, *more)
            while run.goes_on and records(dataset) < min(3, self.pictures // 4):
                time.sleep(LOOK_S)
            if children := run.children():
                worker = self.chance.choice(children)
                worker.send_signal(signal.SIGSTOP)
                time.sleep(2 * (picture_timeout or STOPPED_S))
                worker.send_signal(signal.SIGCONT)
                self.counts["SIGSTOP, worker"] += 1
            self._end(run, dataset)

    def table(self) -> str:
        """Return what came of it as Markdown."""
        lines = ["| what | how often |", "| --- | ---: |"]
        lines += [f"| {what} | {count:,} |" for what, count in sorted(self.counts.items())]
        lines += [f"| seconds {what} | {_spread(taken)} |" for what, taken in self.seconds.items()]
        return "\n".join([*lines, f"| did not hold | {len(self.faults)} |", *(f"- {each}" for each in self.faults)])

    def _killed(self, *what: str) -> int:
        return sum(self.counts[f"SIGKILL, {each}"] for each in what)

    def _fresh(self, name: str) -> Path:
        self.counts[f"datasets, {name}"] += 1
        return self.out / f"{name}{self.counts[f'datasets, {name}']}"

    def _start(self, dataset: Path, *more: object) -> SupervisedRun:
        return SupervisedRun("render", self.stage, "--out", dataset, *self.how, *more)

    def _wait(self, run: SupervisedRun) -> bool:
        """Wait for a random while; return whether the run goes on."""
        give_up = time.monotonic() + self.chance.expovariate(1 / self.every_s)
        while run.goes_on and time.monotonic() < give_up:
            run.children()
            time.sleep(LOOK_S)
        return run.goes_on

    def _kill(self, process: psutil.Process, what: str) -> None:
        with suppress(psutil.NoSuchProcess):
            process.kill()
            self.counts[f"SIGKILL, {what}"] += 1

    def _end(self, run: SupervisedRun, dataset: Path) -> None:
        """Let a run end by itself, and look at what it made."""
        while run.goes_on:
            run.children()
            time.sleep(LOOK_S)
        self.faults += self._faults_of(run, dataset)
        self.counts["pictures made"] += records(dataset)

    def _faults_of(self, run: SupervisedRun, dataset: Path) -> Iterator[str]:
        if run.wait():
            yield f"{dataset.name}: exit code {run.wait()}: {run.said().strip()}"
        if not dataset.is_dir():
            return
        yield from (f"{dataset.name}: process {pid} is left" for pid in run.left())
        if self.whole:
            yield from faults(dataset, self.whole, pictures=self.pictures)


def _spread(taken: list[float]) -> str:
    return f"{statistics.median(taken):.1f} ({min(taken):.1f} to {max(taken):.1f})"
