"""A child started before its call is known: it loads its libraries while its supervisor loads its own."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from spin_usd.processes.call import Call
from spin_usd.processes.child import Child, in_process

_waiting: list[Child] = []  # started, and not yet taken: at most one, for a process does one command at a time


@contextmanager
def child_ahead(*calls: Call[Any, Any], writes: Sequence[Path] = ()) -> Iterator[None]:
    """Start a child that loads the modules of `calls`, for the first `next_child` in the block; if it is not taken, it
    is ended with the block. `writes`: as for Child; the first is made if missing, and removed if it stays empty."""
    above = [each for folder in writes[:1] for each in (folder, *folder.parents)]
    missing = [] if in_process() else [each for each in above if not each.exists()]
    try:
        with suppress(OSError):  # reported where it is to be written
            for folder in reversed(missing):
                folder.mkdir()
        _waiting.append(next_child(*calls, writes=writes))
        yield
    finally:
        while _waiting:
            _waiting.pop().kill()
        with suppress(OSError):  # not empty
            for folder in missing:
                folder.rmdir()


def hand_on(child: Child) -> None:
    """Let this child be the next in the block of `child_ahead`, or end with it."""
    _waiting.append(child)


def next_child(*calls: Call[Any, Any], writes: Sequence[Path] = ()) -> Child:
    """Return the child that was started ahead, if it may write in these folders, or a new one."""
    if _waiting and _waiting[-1].may_write(writes):
        return _waiting.pop()
    return Child(modules=tuple(call.module for call in calls), writes=writes)
