"""spin-usd run as a user runs it, and what that took."""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from typing import Any

COMMAND = [sys.executable, "-m", "spin_usd.command_line", "--quiet"]


@dataclass(frozen=True, kw_only=True)
class Done:
    """What a command answered to programs (`--json`), and seconds of wall clock and of all its processes, and the
    memory of the largest of them."""

    answer: dict[str, Any]
    wall_s: float
    cpu_s: float
    memory_bytes: int


def run(*arguments: object) -> Done:
    """Run `spin-usd ARGUMENTS --json`; end this program where that fails."""
    output, taken = timed(*arguments, "--json")
    return Done(answer=json.loads(output), **taken)


def timed(*arguments: object) -> tuple[bytes, dict[str, Any]]:
    """Run `spin-usd ARGUMENTS`; return what it printed, and what it took, as Done has it. End this program where it
    fails."""
    words = [*map(str, arguments)]
    began = time.perf_counter()
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen([*COMMAND, *words], stdout=out)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - began
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            sys.exit(f"spin-usd {' '.join(words)} ended with exit code {process.returncode}")
        out.seek(0)
        printed = out.read()
    cpu = usage.ru_utime + usage.ru_stime
    return printed, {"wall_s": wall, "cpu_s": cpu, "memory_bytes": usage.ru_maxrss * 1024}


def asked(*arguments: object) -> dict[str, Any]:
    """Run a command and return its answer."""
    return run(*arguments).answer
