"""The signals that stop a program: Ctrl-C, SIGTERM, and SIGHUP, which a closed terminal sends.

In the command line each raises Stopped. Work that can be finished soon postpones the first.
"""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

STOP_SIGNALS = tuple(each for each in signal.Signals if each.name in ("SIGINT", "SIGTERM", "SIGHUP"))
WAY_OUT_S = 5  # to clean up


class Stopped(BaseException):
    """A signal stopped the program. number: the signal's."""

    def __init__(self, number: int) -> None:
        super().__init__(f"stopped by {signal.Signals(number).name}")
        self.number = number


def let_signals_stop(clock: Callable[[], float] = time.monotonic) -> None:
    """Let each of these signals raise Stopped in the main thread, except within WAY_OUT_S of one that did. An already
    ignored signal stays ignored, as for `nohup`. `clock`: seconds."""
    stop = _Stop(clock)
    for number in STOP_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stop)


class _Stop:
    """The handler of stop signals. Signals that follow at once do not interrupt the exit; a later one counts, since
    code called from C may have swallowed the first."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._way_out_until = float("-inf")

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if self._clock() < self._way_out_until:
            return
        self._way_out_until = self._clock() + WAY_OUT_S
        raise Stopped(number)


@dataclass(kw_only=True)
class StopRequest:
    """A stop request in the meantime."""

    number: int | None = None
    """Number of the first signal; None before one came."""


@contextmanager
def postponed() -> Iterator[StopRequest]:
    """Postpone the first signal until the block has succeeded, and report it; a second acts at once. SIGHUP is never a
    second one: shells send it twice.

    Signals that would not raise here are left alone, as are all outside the main thread.
    """
    request = StopRequest()
    before = {number: handler for number in STOP_SIGNALS if callable(handler := signal.getsignal(number))}

    def note(number: int, frame: FrameType | None) -> None:
        if request.number is None:
            request.number = number
        elif number != signal.SIGHUP:
            before[signal.Signals(number)](number, frame)

    if threading.current_thread() is not threading.main_thread():
        before = {}
    for number in before:
        signal.signal(number, note)
    try:
        yield request
    finally:
        for number, handler in before.items():
            if signal.getsignal(number) is note:
                signal.signal(number, handler)
    if request.number is not None:
        signal.raise_signal(request.number)
