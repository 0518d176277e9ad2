"""The most memory that this process held during a stretch of work."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil

RESET_PEAK = "5"  # proc(5), /proc/pid/clear_refs: reset the peak resident set size to the current one
PEAK = "VmHWM:"  # proc(5), /proc/pid/status: peak resident set size, kB


def watch_memory() -> Callable[[], int]:
    """Begin a stretch; the function that comes back returns the most bytes held since. Where the system keeps no peak
    that can be reset, it returns what is held at the end."""
    try:
        Path("/proc/self/clear_refs").write_text(RESET_PEAK, encoding="ascii")
    except OSError:
        return _held
    return _peak


def _peak() -> int:
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith(PEAK):
                return 1024 * int(line.split()[1])
    return _held()


def _held() -> int:
    return int(psutil.Process().memory_info().rss)
