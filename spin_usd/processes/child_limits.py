"""Limits of a child process: our own, those of this machine, and those of the process that started us.

The system can limit address space, not used memory (setrlimit(2), RLIMIT_AS): libraries reserve some that they never
use.
"""

import tempfile
from collections.abc import Iterator
from contextlib import suppress

from spin_usd.errors import InputError, OutputError
from spin_usd.processes.control_groups import group_limits

# Seconds of a processor, not of the clock (see Patience), from one message of a child to the next.
PATIENCE_S = 120.0  # for a child that reads: a stage may be built so that it never opens
START_PATIENCE_S = 300.0  # for one to open a renderer: Blender is a gigabyte, perhaps on a shared disk
RENDER_PATIENCE_S = 3600.0  # for one that renders a picture, where no limit is given

DRIVERS_RESERVE = 1 << 44  # bytes: drivers of graphics processors reserve what all memory of all devices needs
RESERVED = 4 << 30  # bytes that Blender and its libraries reserve without using them: 2.9 GiB on two processors
MIN_MEMORY = 2 << 30  # bytes of address space: libraries take 1.3 GiB before they read anything
MIN_FILES = 64  # open at once


def reading_memory() -> int:
    """Return the bytes of address space for a child that reads files of others: half of the memory."""
    return _allowed(max(machine_memory() // 2, MIN_MEMORY))


def rendering_memory(*, graphics: bool = False) -> int:
    """Return the bytes of address space for a child that renders: all of the memory, and the reserve of drivers if it
    may use a graphics processor (`graphics`)."""
    return _allowed(machine_memory() + RESERVED + (DRIVERS_RESERVE if graphics else 0))


def machine_memory() -> int:
    """Return the bytes of memory that this machine has, or the control group that we run in."""
    import psutil  # not above: it is slow to load, and every command needs this file

    return min([int(psutil.virtual_memory().total), *_group_limits()])


def refuse_tight_limits() -> None:
    """Raise InputError where a limit of this shell leaves no room for any command, OutputError without a folder for
    temporary files."""
    try:
        tempfile.gettempdir()
    except FileNotFoundError:
        do = "set TMPDIR to one, free some space, or raise the limit of a file's size (ulimit -f)"
        raise OutputError("no folder for temporary files can be written", do=do) from None
    with suppress(ModuleNotFoundError):  # Windows has no such limits
        _refuse_tight_limits()


def _refuse_tight_limits() -> None:
    import resource

    for limit, least, word in (
        (resource.RLIMIT_AS, MIN_MEMORY, "of address space (ulimit -v) is {0:.3g} GiB, and {1:.3g} GiB are needed"),
        (resource.RLIMIT_NOFILE, MIN_FILES, "of open files (ulimit -n) is {2}, and {3} are needed"),
    ):
        given = resource.getrlimit(limit)[0]
        if given != resource.RLIM_INFINITY and given < least:
            found = word.format(given / 2**30, least / 2**30, given, least)
            raise InputError(f"the limit {found}", do="raise it in the shell, or in the program that started it")


def _allowed(wanted: int) -> int:
    """Return the bytes wanted, or a lower limit of this process: only root may raise it."""
    import resource  # not above: Windows, where datasets are read, has none

    given = resource.getrlimit(resource.RLIMIT_AS)
    return min([wanted, *(limit for limit in given if limit != resource.RLIM_INFINITY)])


def _group_limits() -> Iterator[int]:
    """Yield the bytes that each control group that holds us may have."""
    for words in group_limits("memory", ["memory.limit_in_bytes"], "memory.max"):
        with suppress(ValueError):  # "max"
            yield int(words[0])
