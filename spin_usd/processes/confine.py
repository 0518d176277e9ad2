"""A process that may read no file but a model's neighbours: Linux itself refuses all other files.

Files that a library opens while it parses cannot be checked before. If the kernel lacks Landlock (5.13), the walk over
the paths that a model names is the only check. Source: landlock(7).
"""

import ctypes
import os
import struct
import sys
import tempfile
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

READ_FILE = 1 << 2
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
    libc = ctypes.CDLL(None, use_errno=True)
    handled = struct.pack("Q", READ_FILE)
    rules = libc.syscall(CREATE_RULESET, handled, ctypes.c_size_t(len(handled)), 0) if sys.platform == "linux" else -1
    if rules < 0:
        return False
    for path in (*SYSTEM, sys.prefix, sys.base_prefix, str(Path(__file__).parents[1]), tempfile.gettempdir()):
        _allow(libc, rules, path)
    files = list(islice(_plain_files(Path(root)), MAX_FILES))
    for file in files if len(files) < MAX_FILES else [root]:  # if there are too many, pipes among them are allowed too
        _allow(libc, rules, file)
    libc.prctl(NO_NEW_PRIVS, 1, 0, 0, 0)
    done = libc.syscall(RESTRICT_SELF, rules, 0) == 0
    os.close(rules)
    return bool(done)


def _allow(libc: ctypes.CDLL, rules: int, path: str) -> None:
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:  # it is missing, or was removed meanwhile
        return
    libc.syscall(ADD_RULE, rules, PATH_BENEATH, struct.pack("=Qi", READ_FILE, place), 0)
    os.close(place)


def _plain_files(folder: Path) -> Iterator[str]:
    """Yield the regular files below the folder; no link is followed."""
    for place, _, names in os.walk(folder):
        for path in (os.path.join(place, name) for name in names):
            if os.path.isfile(path) and not os.path.islink(path):
                yield path
