"""The signals that ask a program to stop: Ctrl-C, SIGTERM, and SIGHUP, which a closed terminal sends.

The command line lets each raise Stopped. Work that can be finished in short postpones the first.
"""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

STOP_SIGNALS = tuple(each for each in signal.Signals if each.name in ("SIGINT", "SIGTERM", "SIGHUP"))
WAY_OUT_S = 5  # for putting in order what was begun


class Stopped(BaseException):
    """A signal stopped the program. number: the signal's."""

    def __init__(self, number: int) -> None:
        super().__init__(f"stopped by {signal.Signals(number).name}")
        self.number = number


def let_signals_stop(clock: Callable[[], float] = time.monotonic) -> None:
    """Let each of these signals raise Stopped in the main thread, but for those that come within WAY_OUT_S of one that
    did. One that is ignored already stays so: `nohup` asks for that. `clock`: seconds."""
    stop = _Stop(clock)
    for number in STOP_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stop)


class _Stop:
    """The handler of signals that stop. Those that follow at once do not interrupt the way out; a later one counts, for
    code that was called from C can have swallowed the first."""

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
    """What was asked for meanwhile."""

    number: int | None = None
    """Number of the first signal; None before one came."""


@contextmanager
def postponed() -> Iterator[StopRequest]:
    """Keep the first signal back until the block has ended well, and say that it came; a second does at once what it
    always does. SIGHUP is never a second one: shells send it twice.

    Signals that would raise nothing here are left alone, and so are all outside the main thread.
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
