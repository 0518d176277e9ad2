"""A process that may read no file but a model's neighbours, or write only in one folder: Linux refuses all others.

Files that a library opens while it parses cannot be checked before. If the kernel lacks Landlock (5.13), the walk over
the paths that a model names is the only check. Source: landlock(7).
"""

import ctypes
import os
import struct
import sys
import tempfile
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

READ_FILE, WRITE_FILE, TRUNCATE = 1 << 2, 1 << 1, 1 << 14
WRITE = WRITE_FILE | TRUNCATE | sum(1 << bit for bit in range(4, 14))  # to make, move and remove all kinds of files
OF_FILES = READ_FILE | WRITE_FILE | TRUNCATE
CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446  # the same on all architectures
PATH_BENEATH, ASK_VERSION = 1, 1
NO_NEW_PRIVS = 38  # linux/prctl.h
SYSTEM = (
    *("/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/localtime", "/dev/null", "/dev/urandom", "/dev/shm"),
    *("/proc/cpuinfo", "/proc/meminfo", "/proc/stat", "/sys/devices/system"),
)
MAX_FILES = 2**14  # each takes some microseconds


def landlock_version() -> int:
    """Return which version of Landlock the kernel has, 0 for none."""
    if sys.platform != "linux":
        return 0
    return max(int(ctypes.CDLL(None).syscall(CREATE_RULESET, None, ctypes.c_size_t(0), ASK_VERSION)), 0)


def confine(root: str) -> bool:
    """Let this process, and all that it starts, read from now on only plain files below the folder `root`, its own
    temporary files, the system and installed packages. Return whether the kernel enforces it."""
    files = list(islice(_plain_files(Path(root)), MAX_FILES))
    own = (*SYSTEM, sys.prefix, sys.base_prefix, str(Path(__file__).parents[1]), tempfile.gettempdir())
    # if there are too many, pipes among them are allowed too
    return _restrict(READ_FILE, (*own, *(files if len(files) < MAX_FILES else [root])))


def confine_writing(folders: Iterable[str]) -> bool:
    """Let this process, and all that it starts, write, make, move and remove files from now on only among its own
    temporary files and below the `folders`; one that is missing stands for the nearest existing folder above it.
    Threads that run already stay as they are. Return whether the kernel enforces it; before version 3 it cannot.

    Every child begins so, except the worker of a cluster, and one that uses a graphics processor: its driver keeps what
    it compiles in caches of the user's, opens devices to write and names threads in /proc, each in places of its own.
    """
    there = (next(each for each in (Path(name), *Path(name).parents) if each.is_dir()) for name in folders)
    allowed = (*map(str, there), tempfile.gettempdir(), "/dev/null", "/dev/shm")
    return landlock_version() >= 3 and _restrict(WRITE, allowed)


def _restrict(rights: int, paths: Iterable[str]) -> bool:
    """Give up `rights` but below `paths`; return whether the kernel enforces it."""
    libc = ctypes.CDLL(None, use_errno=True)
    handled = struct.pack("Q", rights)
    rules = libc.syscall(CREATE_RULESET, handled, ctypes.c_size_t(len(handled)), 0) if sys.platform == "linux" else -1
    if rules < 0:
        return False
    for path in paths:
        _allow(libc, rules, path, rights if os.path.isdir(path) else rights & OF_FILES)
    libc.prctl(NO_NEW_PRIVS, 1, 0, 0, 0)
    done = libc.syscall(RESTRICT_SELF, rules, 0) == 0
    os.close(rules)
    return bool(done)


def _allow(libc: ctypes.CDLL, rules: int, path: str, rights: int) -> None:
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:  # it is missing, or was removed meanwhile
        return
    libc.syscall(ADD_RULE, rules, PATH_BENEATH, struct.pack("=Qi", rights, place), 0)
    os.close(place)


def _plain_files(folder: Path) -> Iterator[str]:
    """Yield the regular files below the folder; no link is followed."""
    for place, _, names in os.walk(folder):
        for path in (os.path.join(place, name) for name in names):
            if os.path.isfile(path) and not os.path.islink(path):
                yield path
