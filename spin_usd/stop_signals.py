"""The signals that ask a program to stop: Ctrl-C, SIGTERM, and SIGHUP, which a closed terminal sends.

The command line lets each raise Stopped. Work that can be finished in short postpones the first.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stopped(BaseException):
    """A signal stopped the program. number: the signal's."""

    def __init__(self, number: int) -> None:
        super().__init__(f"stopped by {signal.Signals(number).name}")
        self.number = number


def let_signals_stop() -> None:
    """Let the first of these signals raise Stopped in the main thread; later ones are ignored, so that none interrupts
    the way out. One that is ignored already stays so: `nohup` asks for that."""
    for number in STOP_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def _stop(number: int, frame: FrameType | None) -> None:
    for each in STOP_SIGNALS:
        signal.signal(each, signal.SIG_IGN)
    raise Stopped(number)


@dataclass(kw_only=True)
class StopRequest:
    """What was asked for meanwhile. number: that of the first signal; None before one came."""

    number: int | None = None


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
