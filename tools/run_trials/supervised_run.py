"""A `spin-usd render` in a process of its own, with its children as the system sees them."""

import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

COMMAND = [sys.executable, "-m", "spin_usd.command_line", "--quiet"]
GONE_WITHIN_S = 20.0


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
