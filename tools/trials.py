"""What trials of whole runs share: a stage of small pictures, a run watched from outside, datasets compared."""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

import spin_usd
from spin_usd import resources
from spin_usd.sha256 import sha256_of

COMMAND = [sys.executable, "-m", "spin_usd.command_line", "--quiet"]
GONE_WITHIN_S = 20.0
TIMINGS = "cache/measured.json"  # what a run took: no two runs take the same
POSES = resources.stages() / "examples" / "tango_speedplus_poses.json"
CAMERA = {"Nu": 64, "Nv": 48, "cameraMatrix": [[100, 0, 32], [0, 100, 24], [0, 0, 1]], "distCoeffs": [0, 0, 0, 0, 0]}
RELIGHT = 'schema = "augment-1"\nseed = 0\n\n[[augmentation]]\nname = "v"\ncount = {count}\n\n[augmentation.sample]\n'
RELIGHT += '"sun.direction" = {{ distribution = "directions", per = "frame" }}\n'


def author(folder: Path, frames: int, variants: int = 1) -> Path:
    """Write a stage of so many frames and variants, each with a direction of the Sun for each frame; return its root
    layer."""
    folder.mkdir(parents=True)
    known = json.loads(POSES.read_text())
    poses = [{**known[i % len(known)], "filename": f"img{i:06d}.png"} for i in range(frames)]
    (folder / "poses.json").write_text(json.dumps(poses))
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    made = spin_usd.author(
        poses=folder / "poses.json", target="cubesat", camera=folder / "camera.json", out=folder / "stage"
    )
    if variants > 1:
        (folder / "relight.toml").write_text(RELIGHT.format(count=variants - 1))
        spin_usd.augment(made.root, spec=folder / "relight.toml")
    return Path(made.root)


class SupervisedRun:
    """A run of `spin-usd ARGUMENTS`. pids: all children that were ever seen."""

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


def faults(dataset: Path, whole: dict[str, str], *, pictures: int) -> Iterator[str]:
    """Yield what is wrong with a dataset that should hold the files with the digests `whole`."""
    found = digests(dataset)
    yield from (f"{dataset.name}: {name} is missing" for name in sorted(whole.keys() - found.keys()))
    yield from (f"{dataset.name}: {name} is left" for name in sorted(found.keys() - whole.keys()))
    yield from (f"{dataset.name}: {n} has other bytes" for n in sorted(whole.keys() & found) if whole[n] != found[n])
    yield from (f"{dataset.name}: {path.name} is left" for path in dataset.iterdir() if path.name.startswith("."))
    yield from torn(dataset)
    made = sum(1 for _ in (dataset / "records").glob("*/*.json"))
    if made != pictures:
        yield f"{dataset.name}: {made} of {pictures} pictures"


def torn(dataset: Path) -> Iterator[str]:
    """Yield which files are not as the records say that there are."""
    for path in (dataset / "records").glob("*/*.json"):
        for entry in json.loads(path.read_text())["files"].values():
            file = dataset / entry["path"]
            if not file.is_file() or sha256_of(file) != entry["sha256"]:
                yield f"{dataset.name}: {entry['path']} is not as its record says"
