"""Disturb runs of many small pictures, and compare what comes of them with an undisturbed one.

    tools/try_kills [--kills K] [--supervisor-kills K] [--stops K] [--full-disks N] [--power-cuts N] [--limits N]
                    [--out DIR]

A run ends by itself, with exit code 0, however often its planning and rendering children get SIGKILL; one whose
supervisor gets it leaves no process, and the same command takes up where it stopped. A worker that gets SIGSTOP is
ended, and replaced. On full and read-only disks, beside another run, and under limits of memory, files and their size a
run ends with exit code 0, 1 or 2 and a sentence, and leaves no temporary file and no record of a file that is not
whole. Each dataset is completed by the same command, to the byte as an undisturbed one. Such disks are small ones in
memory (tmpfs), which only root can mount; others have the rest tried. A power cut is a file system (ext4, in a file)
that drops at a random moment what it has not written, and is mounted again: records without their whole files are
counted, and `--verify` completes the dataset. Exit code 1: something did not hold.
"""

import argparse
import fcntl
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from array import array
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import psutil
from trials import SupervisedRun, author, digests, faults, records, torn

from spin_usd.processes.deaths import TRIES, DeathCause

LOOK_S = 0.02
STOPPED_S = 60.0
GIVEN_UP = f"SIGKILL (perhaps the system was out of memory), {TRIES[DeathCause.KILLED]} times"
SAID = (0, 1, 2)  # exit codes of what a user can mend
MIN_DISK, STEP = 200_000, 60_000  # bytes that a disk has at first, and gets more at most
MEMORY = (1 << 28, 1 << 34)  # bytes of address space, least and most
FILES = (4, 256)
POWER_CUT_DISK = 1 << 28  # bytes
SHUTDOWN, NO_LOG_FLUSH = 0x8004587D, 2  # of ioctl_ext4(2): EXT4_IOC_SHUTDOWN, which then leaves the journal as it is


@dataclass(kw_only=True)
class Trial:
    """A trial over one stage. how: the runs' options · every_s: seconds between kills, on average · counts, faults:
    what came of it · whole: digests of the dataset that the others must be equal to."""

    stage: Path
    out: Path
    pictures: int
    how: tuple[object, ...]
    every_s: float
    chance: random.Random
    counts: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    whole: dict[str, str] = field(default_factory=dict)

    def make_whole(self) -> None:
        """Make the dataset that the others must be equal to."""
        self._ended(self._start(self.out / "whole"), "undisturbed", self.out / "whole")
        self.whole = digests(self.out / "whole")

    def kill_children(self, kills: int) -> None:
        """Kill so many children at least, of as many runs as that takes. A run gives up, and is run again, where the
        same work was killed as often as runs forgive."""
        while self.counts["SIGKILL, child"] < kills:
            dataset = self._fresh("children")
            while self._killed_at(run := self._start(dataset)):
                self.counts["runs that gave up"] += 1
                self.faults += [f"{dataset.name}: process {pid} is left" for pid in run.left()]
            self._completed(dataset, run)

    def _killed_at(self, run: SupervisedRun) -> bool:
        """Kill children of the run until it has ended; return whether it gave up for that."""
        while self._wait(run):
            if (children := run.children()) and run.goes_on:
                self._kill(self.chance.choice(children), "child")
        return run.wait() == 1 and GIVEN_UP in run.said()

    def kill_supervisors(self, kills: int) -> None:
        """Kill so many supervisors; each dataset is taken up by the next until it is whole."""
        while self.counts["SIGKILL, supervisor"] < kills:
            dataset = self._fresh("supervisors")
            run = self._start(dataset)
            while self.counts["SIGKILL, supervisor"] < kills and self._wait(run):
                run.children()
                self._kill(psutil.Process(run.process.pid), "supervisor")
                run.wait()
                self.faults += [f"process {pid} is left" for pid in run.left()]
                run = self._start(dataset)
            self._completed(dataset, run)

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
                with suppress(psutil.NoSuchProcess):
                    worker.send_signal(signal.SIGCONT)
                self.counts["SIGSTOP, worker"] += 1
            self._completed(dataset, run)

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

    def power_cuts(self, times: int) -> None:
        """Cut the power of so many runs' disks, each at a random moment, and complete the dataset by `--verify`."""
        image, place = self.out / "disk.ext4", self.out / "disk"
        for _ in range(times):
            with image.open("wb") as file:
                file.truncate(POWER_CUT_DISK)
            subprocess.run(["mkfs.ext4", "-q", "-F", str(image)], check=True)
            with _mounted(place, "-o", "loop", str(image)) as disk:
                run = self._start(disk / "dataset")
                self._wait(run)
                _cut_power(disk)
                while run.goes_on:
                    run.children()
                    time.sleep(LOOK_S)
                self.counts[f"power cut: exit code {run.wait()}"] += 1
                self.faults += [f"power cut: process {pid} is left" for pid in run.left()]
            with _mounted(place, "-o", "loop", str(image)) as disk:
                self.counts["pictures with a record after a power cut"] += records(disk / "dataset")
                self.counts["files cut short by a power cut"] += sum(1 for _ in torn(disk / "dataset"))
                self._completed(disk / "dataset", self._start(disk / "dataset", "--verify"))

    def two_at_once(self) -> None:
        """Run twice at the same time into one folder."""
        dataset = self._fresh("two at once")
        first = self._start(dataset)
        time.sleep(self.chance.uniform(0, 2))
        second = self._start(dataset)
        self._ended(second, "the second of two", dataset, swept=False)
        self._ended(first, "the first of two", dataset)
        self._completed(dataset)

    def limited(self) -> None:
        """Run under limits of setrlimit(2), each between a least and a most."""
        largest = max(path.stat().st_size for path in (self.out / "whole").rglob("*") if path.is_file())
        for what, limit, (low, high) in (
            ("bounded files", resource.RLIMIT_FSIZE, (1, largest)),
            ("ulimit -v", resource.RLIMIT_AS, MEMORY),
            ("ulimit -n", resource.RLIMIT_NOFILE, FILES),
        ):
            # As often near the least as near the most of them by their digits.
            value, dataset = int(low * (high / low) ** self.chance.random()), self._fresh(what)
            run = self._start(dataset, preexec_fn=partial(resource.setrlimit, limit, (value, value)))
            self._ended(run, what, dataset)
            self._completed(dataset)

    def table(self) -> str:
        """Return what came of it as Markdown."""
        lines = ["| what | how often |", "| --- | ---: |"]
        lines += [f"| {what} | {count:,} |" for what, count in sorted(self.counts.items())]
        return "\n".join([*lines, f"| did not hold | {len(self.faults)} |", *(f"- {each}" for each in self.faults)])

    def _fresh(self, name: str) -> Path:
        self.counts[f"datasets, {name}"] += 1
        return self.out / f"{name.replace(' ', '_')}{self.counts[f'datasets, {name}']}"

    def _start(self, dataset: Path, *more: object, preexec_fn: Callable[[], None] | None = None) -> SupervisedRun:
        words = ("render", self.stage, "--out", dataset, *self.how, *more)
        return SupervisedRun(*words, preexec_fn=preexec_fn)

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

    def _ended(self, run: SupervisedRun, what: str, dataset: Path, *, swept: bool = True) -> int:
        """Wait for the end of a run, look at what it left, and return its exit code."""
        while run.goes_on:
            run.children()
            time.sleep(LOOK_S)
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

    def _completed(self, dataset: Path, run: SupervisedRun | None = None) -> None:
        """Let this run, or one more without any trouble, end: the dataset must be whole then."""
        run = run or self._start(dataset)
        if self._ended(run, "completed", dataset):
            self.faults.append(f"{dataset.name}: {run.said().strip()}")
        self.faults += faults(dataset, self.whole, pictures=self.pictures)


@contextmanager
def _disk(place: Path, size: int) -> Iterator[Path]:
    """Give a disk of so many bytes, in memory."""
    with _mounted(place, "-t", "tmpfs", "-o", f"size={size}", "none"):
        yield place


@contextmanager
def _mounted(place: Path, *what: str) -> Iterator[Path]:
    """Mount `what`, as mount(8) takes it, at the place."""
    place.mkdir(exist_ok=True)
    subprocess.run(["mount", *what, str(place)], check=True)
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def _cut_power(disk: Path) -> None:
    """Have the file system at `disk` write nothing any more, also of what it was given before."""
    folder = os.open(disk, os.O_RDONLY)
    try:
        fcntl.ioctl(folder, SHUTDOWN, array("I", [NO_LOG_FLUSH]))
    finally:
        os.close(folder)


def _remount(disk: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", str(disk)], check=True)


def main() -> int:
    options = _options()
    with tempfile.TemporaryDirectory(prefix="spin-usd-kills-") as folder:
        out = options.out or Path(folder)
        trial = Trial(
            stage=author(out / "authored", options.pictures),
            out=out,
            pictures=options.pictures,
            how=("--renderer", options.renderer, "--samples", options.samples, "--workers", options.workers),
            every_s=options.every,
            chance=random.Random(options.seed),
        )
        trial.make_whole()
        trial.kill_children(options.kills)
        trial.kill_supervisors(options.supervisor_kills)
        trial.stop_workers(options.stops, options.picture_timeout)
        if os.geteuid() == 0 and options.full_disks:
            trial.full_disk(options.full_disks)
            trial.read_only()
        if os.geteuid() == 0:
            trial.power_cuts(options.power_cuts)
        for _ in range(options.limits):
            trial.two_at_once()
            trial.limited()
    print(trial.table())
    return int(bool(trial.faults))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pictures", type=int, default=30)
    parser.add_argument("--kills", type=int, default=5, help="of children, at least")
    parser.add_argument("--supervisor-kills", type=int, default=2)
    parser.add_argument("--stops", type=int, default=0, help="of workers, by SIGSTOP")
    parser.add_argument("--picture-timeout", type=float, metavar="S", help="of the runs whose workers are stopped")
    parser.add_argument("--every", type=float, default=1.0, metavar="S", help="seconds between kills, on average")
    parser.add_argument("--full-disks", type=int, default=3, help="how often a disk is full, at a random place")
    parser.add_argument("--power-cuts", type=int, default=0, help="how often the power of a disk is cut")
    parser.add_argument("--limits", type=int, default=1, help="how often limits and two runs at once are tried")
    parser.add_argument("--renderer", default="raycast")
    parser.add_argument("--samples", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, metavar="DIR", help="an empty folder, in which all datasets are kept")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
