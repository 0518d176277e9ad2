"""A child started before its call is known: it loads its libraries while its supervisor loads its own."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from spin_usd.processes.call import Call
from spin_usd.processes.child import Child

_waiting: list[Child] = []  # started, and not yet taken: at most one, for a process does one command at a time


@contextmanager
def child_ahead(*calls: Call[Any, Any]) -> Iterator[None]:
    """Start a child that loads the modules of `calls`, for the first `next_child` in the block; if it is not taken, it
    is ended with the block."""
    _waiting.append(Child(modules=tuple(call.module for call in calls)))
    try:
        yield
    finally:
        while _waiting:
            _waiting.pop().kill()


def hand_on(child: Child) -> None:
    """Let this child be the next in the block of `child_ahead`, or end with it."""
    _waiting.append(child)


def next_child() -> Child:
    """Return the child that was started ahead, or a new one."""
    return _waiting.pop() if _waiting else Child()
