"""A folder for temporary files that lives as long as its process: the next one removes the folder of a killed one."""

import fcntl
import os
import shutil
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

PREFIX = "spin_usd-"
HELD = ".held"  # locked by the process whose folder it is


class HeldFolder:
    """`name`: its path."""

    def __init__(self) -> None:
        _remove_leftovers(tempfile.gettempdir())
        self._folder = tempfile.TemporaryDirectory(prefix=PREFIX)
        self.name = self._folder.name
        own = Path(self.name, "own")
        self._lock = own.open("wb")
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        own.rename(own.with_name(HELD))  # now: others take an unlocked folder of that name for a leftover

    def cleanup(self) -> None:
        """Remove the folder with all its content; a second call does nothing."""
        self._folder.cleanup()
        self._lock.close()


def nameless_file() -> int:
    """Return the descriptor of a new file without a name, in memory where the system can: it is gone once it is closed
    by all who have it."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("spin_usd")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


def nameless_file_of(process: int, descriptor: int) -> int:
    """Return a descriptor of the nameless file that another living process has open. Raises OSError where it does not
    or may not be read."""
    return os.open(f"/proc/{process}/fd/{descriptor}", os.O_RDWR | os.O_CLOEXEC)


@cache
def _remove_leftovers(place: str) -> None:
    """Remove the folders in `place` that no living process holds; once a process. A lock decides this, not a process
    id: another container on the same disk counts its processes by itself."""
    for path in Path(place).glob(f"{PREFIX}*/{HELD}"):
        with suppress(OSError):
            lock = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
            try:
                if os.fstat(lock).st_uid == os.getuid():
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(path.parent, ignore_errors=True)
            finally:
                os.close(lock)
