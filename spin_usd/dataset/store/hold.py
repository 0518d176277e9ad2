"""The hold of a run on a lock file, for as long as a block takes; a killed run's hold ends with its last process.

The lock is that of `flock`. It holds between machines where the file system of a shared folder says so: NFS does (its
version 3 with the lock service), Lustre where it is mounted with `flock`. A file system without locks is refused.
"""

import errno
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from spin_usd.dataset.store.lock import Lock, create_lock, new_token, refuse_other_file, take_alone, take_lock
from spin_usd.errors import InputError, OutputError

PATIENCE_S = 5.0  # a killed run's last worker needs a moment to die
FIRST_LOOK_S, LONGEST_LOOK_S = 0.05, 1.0  # between two looks: a hundred machines may wait for one file server
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


@contextmanager
def held(
    path: Path,
    *,
    busy: str | None = None,
    shared: bool = False,
    stays: bool = False,
    at_last: Callable[[], None] = lambda: None,
) -> Iterator[Lock]:
    """Hold the lock at `path`, made where there is none: alone, or `shared` with others that share it.

    Whoever holds it alone in the end calls `at_last` and removes it, unless it `stays`. While another run holds it this
    waits: for ever, or for PATIENCE_S seconds where `busy` is given, which is what the InputError says then. Raises
    OutputError.
    """
    try:
        lock = _acquired(path, busy, shared)
    except OSError as e:
        refuse_other_file(path)
        raise _unwritable(path, e) from e
    try:
        yield lock
    finally:
        if not stays and (not shared or take_alone(lock)):
            at_last()
            path.unlink(missing_ok=True)
        os.close(lock.descriptor)


def await_token(path: Path) -> None:
    """Wait at most PATIENCE_S seconds for an empty lock to be written: it was made an instant ago."""
    give_up = time.monotonic() + PATIENCE_S
    with suppress(OSError):
        while path.lstat().st_size == 0 and time.monotonic() < give_up:
            time.sleep(FIRST_LOOK_S)


def _acquired(path: Path, busy: str | None, shared: bool) -> Lock:
    began, pause = time.monotonic(), FIRST_LOOK_S
    while True:
        with suppress(FileExistsError):
            create_lock(path, new_token())
        if lock := take_lock(path, shared=shared):
            return lock
        if time.monotonic() > began + PATIENCE_S:
            refuse_other_file(path)
            if busy:
                raise InputError(busy, where=path.parent, do="wait for it, or end it")
        time.sleep(pause)
        pause = min(2 * pause, LONGEST_LOOK_S)


def _unwritable(path: Path, e: OSError) -> OutputError:
    if e.errno in NO_LOCKS:
        do = "mount it with locks (NFS with its lock service, Lustre with flock), or choose another folder"
        return OutputError(f"is on a file system without locks ({e.strerror})", where=path.parent, do=do)
    return OutputError(f"cannot be written ({e.strerror})", where=path.parent, do="choose another folder")
