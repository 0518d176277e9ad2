"""States of files, by which an edit shows: whatever an editor does to save, one of these numbers changes."""

import os
from collections.abc import Iterable, Mapping

FileStates = Mapping[str, list[int] | None]
"""By path the file's inode, size and time of change in nanoseconds; None for one that is not there."""


def states_of(paths: Iterable[str]) -> FileStates:
    """Return the states of these files now."""
    return {path: _state(path) for path in paths}


def _state(path: str) -> list[int] | None:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return [found.st_ino, found.st_size, found.st_mtime_ns]
