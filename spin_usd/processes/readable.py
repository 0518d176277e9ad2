"""Waiting for one descriptor, whatever its number: select(2) takes none from 1024 on."""

import selectors
from typing import Protocol


class Described(Protocol):
    """An object with a file descriptor."""

    def fileno(self) -> int: ...


def readable(stream: int | Described, within_s: float) -> bool:
    """Wait for something to read, or the end; return whether it came within `within_s`."""
    with selectors.PollSelector() as selector:
        selector.register(stream, selectors.EVENT_READ)
        return bool(selector.select(within_s))
