"""Whole runs of many small pictures that are disturbed, and what comes of them beside an undisturbed one.

A run ends by itself, with exit code 0, however often its planning and rendering children get SIGKILL; one whose
supervisor gets it leaves no process, and the same command takes up where it stopped. A worker that gets SIGSTOP is
ended, and replaced. On full and read-only disks, beside another run, and under limits of memory, files and their size a
run ends with exit code 0, 1 or 2 and a sentence, and leaves no temporary file and no record of a file that is not
whole. Each dataset is completed by the same command, to the byte as an undisturbed one. Such disks are small ones in
memory (tmpfs), which only root can mount. A power cut is a file system (ext4, in a file) that drops at a random moment
what it has not written, and is mounted again: `--verify` completes the dataset.
"""

import fcntl
import json
import os
import random
import resource
import shutil
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
from typing import Any

import psutil
import pytest

import spin_usd
from spin_usd.basics import resources
from spin_usd.files.sha256 import sha256_of
from spin_usd.processes.child import IN_PROCESS
from spin_usd.processes.deaths import TRIES, DeathCause

pytestmark = [pytest.mark.children, pytest.mark.campaign, pytest.mark.timeout(900)]
needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root mounts disks")

PICTURES = 10
HOW = ("--renderer", "raycast", "--samples", 1, "--workers", 2)
PICTURE_TIMEOUT_S = 5.0
LOOK_S = 0.02
EVERY_S = 1.0  # between kills, on average
GIVEN_UP = f"SIGKILL (perhaps the system was out of memory), {TRIES[DeathCause.KILLED]} times"
SAID = (0, 1, 2)  # exit codes of what a user can mend
MIN_DISK, STEP = 200_000, 60_000  # bytes that a disk has at first, and gets more at most
MEMORY = (1 << 28, 1 << 34)  # bytes of address space, least and most
FILES = (4, 256)
POWER_CUT_DISK = 1 << 28  # bytes
SHUTDOWN, NO_LOG_FLUSH = 0x8004587D, 2  # of ioctl_ext4(2): EXT4_IOC_SHUTDOWN, which then leaves the journal as it is
COMMAND = [sys.executable, "-m", "spin_usd.command_line", "--quiet"]
GONE_WITHIN_S = 20.0
TIMINGS = "cache/measured.json"  # what a run took: no two runs take the same
POSES = resources.stages() / "examples" / "tango_speedplus_poses.json"
CAMERA = {"Nu": 64, "Nv": 48, "cameraMatrix": [[100, 0, 32], [0, 100, 24], [0, 0, 1]], "distCoeffs": [0, 0, 0, 0, 0]}


def author(folder: Path) -> Path:
    """Write a stage of PICTURES frames; return its root layer."""
    known = json.loads(POSES.read_text())
    poses = [{**known[i % len(known)], "filename": f"img{i:06d}.png"} for i in range(PICTURES)]
    (folder / "poses.json").write_text(json.dumps(poses))
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    made = spin_usd.author(
        poses=folder / "poses.json", target="cubesat", camera=folder / "camera.json", out=folder / "stage"
    )
    return Path(made.root)


class SupervisedRun:
    """A run of `spin-usd ARGUMENTS`. seen: all children that there ever were, by their ids."""

    def __init__(self, *arguments: object, **how: Any) -> None:
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the run
        how = {"stdout": subprocess.DEVNULL, "stderr": self._said, **how}
        self.process = subprocess.Popen([*COMMAND, *map(str, arguments)], **how)
        self.seen: dict[int, psutil.Process] = {}

    @property
    def goes_on(self) -> bool:
        return self.process.poll() is None

    def children(self) -> list[psutil.Process]:
        """Return the children that there are now."""
        found: list[psutil.Process] = []
        with suppress(psutil.Error):
            found = psutil.Process(self.process.pid).children()
        self.seen.update((child.pid, child) for child in found)
        return found

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit code."""
        return self.process.wait(timeout)

    def said(self) -> str:
        """Return what it wrote to standard error."""
        self._said.seek(0)
        return self._said.read().decode(errors="replace")

    def left(self) -> list[int]:
        """Return the processes that are left of it, a while after it has ended."""
        give_up = time.monotonic() + GONE_WITHIN_S
        while (alive := [pid for pid, child in self.seen.items() if _runs(child)]) and time.monotonic() < give_up:
            time.sleep(0.05)
        return alive


def _runs(process: psutil.Process) -> bool:
    with suppress(psutil.Error):
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    return False


def records(dataset: Path) -> int:
    """Return how many pictures are finished."""
    return sum(1 for _ in (dataset / "records").glob("*/*.json"))


def digests(dataset: Path) -> dict[str, str]:
    """Return the sha256 of every file by its name, but of timings; temporary files and locks are files too."""
    files = (path for path in dataset.rglob("*") if path.is_file())
    named = ((path.relative_to(dataset).as_posix(), path) for path in files)
    return {name: sha256_of(path) for name, path in named if name != TIMINGS}


def faults(dataset: Path, whole: dict[str, str]) -> Iterator[str]:
    """Yield what is wrong with a dataset that should hold the files with the digests `whole`."""
    found = digests(dataset)
    yield from (f"{dataset.name}: {name} is missing" for name in sorted(whole.keys() - found.keys()))
    yield from (f"{dataset.name}: {name} is left" for name in sorted(found.keys() - whole.keys()))
    yield from (f"{dataset.name}: {n} has other bytes" for n in sorted(whole.keys() & found) if whole[n] != found[n])
    yield from (f"{dataset.name}: {path.name} is left" for path in dataset.iterdir() if path.name.startswith("."))
    yield from torn(dataset)
    made = sum(1 for _ in (dataset / "records").glob("*/*.json"))
    if made != PICTURES:
        yield f"{dataset.name}: {made} of {PICTURES} pictures"


def torn(dataset: Path) -> Iterator[str]:
    """Yield which files are not as the records say that there are."""
    for path in (dataset / "records").glob("*/*.json"):
        for entry in json.loads(path.read_text())["files"].values():
            file = dataset / entry["path"]
            if not file.is_file() or sha256_of(file) != entry["sha256"]:
                yield f"{dataset.name}: {entry['path']} is not as its record says"


@dataclass(kw_only=True)
class Trial:
    """Runs over one stage, whose datasets go below `out`. counts, faults: what came of them · whole: digests of the
    dataset that the others must be equal to · largest: bytes of its largest file."""

    stage: Path
    out: Path
    largest: int
    chance: random.Random = field(default_factory=partial(random.Random, 0))
    counts: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    whole: dict[str, str] = field(default_factory=dict)

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

    def stop_workers(self, stops: int) -> None:
        """Stop so many workers, each of another run, for longer than a picture may take, and let them go on."""
        for _ in range(stops):
            dataset = self._fresh("stopped")
            run = self._start(dataset, "--picture-timeout", PICTURE_TIMEOUT_S)
            while run.goes_on and records(dataset) < min(3, PICTURES // 4):
                time.sleep(LOOK_S)
            if children := run.children():
                worker = self.chance.choice(children)
                worker.send_signal(signal.SIGSTOP)
                time.sleep(2 * PICTURE_TIMEOUT_S)
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
        for what, limit, (low, high) in (
            ("bounded files", resource.RLIMIT_FSIZE, (1, self.largest)),
            ("ulimit -v", resource.RLIMIT_AS, MEMORY),
            ("ulimit -n", resource.RLIMIT_NOFILE, FILES),
        ):
            # As often near the least as near the most of them by their digits.
            value, dataset = int(low * (high / low) ** self.chance.random()), self._fresh(what)
            run = self._start(dataset, preexec_fn=partial(resource.setrlimit, limit, (value, value)))
            self._ended(run, what, dataset)
            self._completed(dataset)

    def _fresh(self, name: str) -> Path:
        self.counts[f"datasets, {name}"] += 1
        return self.out / f"{name.replace(' ', '_')}{self.counts[f'datasets, {name}']}"

    def _start(self, dataset: Path, *more: object, preexec_fn: Callable[[], None] | None = None) -> SupervisedRun:
        words = ("render", self.stage, "--out", dataset, *HOW, *more)
        return SupervisedRun(*words, preexec_fn=preexec_fn)

    def _wait(self, run: SupervisedRun) -> bool:
        """Wait for a random while; return whether the run goes on."""
        give_up = time.monotonic() + self.chance.expovariate(1 / EVERY_S)
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
        self.faults += faults(dataset, self.whole)


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


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The stage, and the dataset that the others must be equal to."""
    folder = tmp_path_factory.mktemp("undisturbed")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv(IN_PROCESS)
        stage = author(folder)
        run = SupervisedRun("render", stage, "--out", folder / "whole", *HOW)
        assert run.wait() == 0, run.said()
    return stage, folder / "whole"


@pytest.fixture
def trial(undisturbed, tmp_path):
    """A trial that has no faults when the test ends."""
    stage, whole = undisturbed
    trial = Trial(stage=stage, out=tmp_path, largest=max(p.stat().st_size for p in whole.rglob("*") if p.is_file()))
    trial.whole = digests(whole)
    yield trial
    assert trial.faults == [], trial.counts


def test_runs_outlive_the_death_of_their_children(trial) -> None:
    trial.kill_children(3)


def test_a_run_takes_up_where_one_was_killed(trial) -> None:
    trial.kill_supervisors(2)


def test_a_worker_that_stands_still_is_replaced(trial) -> None:
    trial.stop_workers(1)


def test_two_runs_into_one_folder_make_it_once(trial) -> None:
    trial.two_at_once()


def test_limits_of_memory_and_files_are_said_in_a_sentence(trial) -> None:
    trial.limited()


@needs_root
def test_a_full_disk_gets_room_and_the_run_goes_on(trial) -> None:
    trial.full_disk(2)


@needs_root
def test_a_disk_that_became_read_only_loses_nothing(trial) -> None:
    trial.read_only()


@needs_root
def test_a_power_cut_is_mended_by_verify(trial) -> None:
    trial.power_cuts(1)


def test_torn_missing_and_left_files_are_faults(undisturbed, tmp_path) -> None:
    """Else the tests above would prove nothing."""
    whole = undisturbed[1]
    other = shutil.copytree(whole, tmp_path / "other")
    assert list(faults(other, digests(whole))) == []
    next((other / "image" / "nominal").iterdir()).write_bytes(b"torn")
    (other / ".work-x").mkdir()
    next((other / "records" / "nominal").iterdir()).unlink()
    assert len(list(faults(other, digests(whole)))) >= 4
