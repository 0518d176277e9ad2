"""A lock file whose random token marks which of the files beside it are ours.

A lock is ours if it contains only a token in our format; files with the same token in their names were made under it.
The token stays as long as the file: a run that takes the lock of a killed run also takes its remains.
"""

import errno
import fcntl
import os
import re
import secrets
import stat
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from spin_usd.errors import InputError

TEXT = "spin_usd {}\n"
TOKEN = re.compile(rb"spin_usd ([0-9a-f]{32})\n")
MAX_BYTES = 64  # more than a lock has


class Lock(NamedTuple):
    """A lock that is held as long as its descriptor is open, here or in a child."""

    descriptor: int
    token: str


def new_token() -> str:
    """Return a token that no other process has ever made."""
    return secrets.token_hex(16)


def token_in(path: Path) -> str | None:
    """Return the token of the lock at `path`; None if it does not exist, or is not ours."""
    with suppress(OSError):
        descriptor = _open(path, os.O_RDONLY)
        try:
            return _token(descriptor)
        finally:
            os.close(descriptor)
    return None


def create_lock(path: Path, token: str) -> None:
    """Make the lock at `path`, forced to disk: an empty lock after a power cut would have no owner. Raises
    FileExistsError if something exists there, and other OSErrors, leaving nothing."""
    text, descriptor = TEXT.format(token).encode(), _open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL)
    try:
        if os.write(descriptor, text) < len(text):  # no error: the disk, or a limit, has room for a part
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        os.fsync(descriptor)
    except OSError:
        path.unlink()
        raise
    finally:
        os.close(descriptor)


def take_lock(path: Path, *, shared: bool = False) -> Lock | None:
    """Hold the lock at `path`, alone or `shared` with others that share it; None where it is another's, or gone, or not
    yet written. Raises OSError, also where the file system has no locks."""
    try:
        descriptor = _open(path, os.O_RDWR)
    except FileNotFoundError:
        return None
    token = None
    try:
        if _flock(descriptor, fcntl.LOCK_SH if shared else fcntl.LOCK_EX) and _is_at(path, descriptor):
            token = _token(descriptor)
    finally:
        if token is None:
            os.close(descriptor)
    return Lock(descriptor, token) if token else None


def take_alone(lock: Lock) -> bool:
    """Turn the shared lock into an exclusive one, and return whether that succeeded; if not, the lock is released."""
    return _flock(lock.descriptor, fcntl.LOCK_EX)


def refuse_other_file(path: Path) -> None:
    """Raise InputError where something is at `path` and is not a lock of ours."""
    if os.path.lexists(path) and token_in(path) is None:
        raise InputError("exists and is not a lock of spin-usd", where=path, do="move it elsewhere, or remove it")


def _flock(descriptor: int, kind: int) -> bool:
    """Lock the open file in that way, and return whether no other lock was in the way. Raises OSError."""
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _is_at(path: Path, descriptor: int) -> bool:
    """Return whether the open file is still the one at `path`: the run before may have removed it between our opening
    and our locking it. Opening it again asks the file server, while its attributes may come from this machine's
    cache."""
    with suppress(FileNotFoundError):
        again = _open(path, os.O_RDONLY)
        try:
            return os.path.samestat(os.fstat(descriptor), os.fstat(again))
        finally:
            os.close(again)
    return False


def _open(path: Path, flags: int) -> int:
    """Open the file, following no link and waiting for no other end of a pipe."""
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)


def _token(descriptor: int) -> str | None:
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        return None
    found = TOKEN.fullmatch(os.pread(descriptor, MAX_BYTES, 0))
    return found[1].decode() if found else None
