"""Progress of long operations on standard error: bars on a terminal, a line now and then elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from spin_usd.basics.progress import Progress, no_progress
from spin_usd.terminal.lines import is_terminal, print_err

LINE_EVERY_S = 10.0


@contextmanager
def shown(quiet: bool = False) -> Iterator[Progress]:
    """Give a function that reports progress: the name of the counted things, such as "rendering: picture", the number
    done and the total."""
    if quiet:
        yield no_progress
    elif is_terminal(sys.stderr):
        from spin_usd.terminal.bars import bars

        with bars() as report:
            yield report
    else:
        yield _Lines()


class _Lines:
    """A line at the start, at the end, and every LINE_EVERY_S seconds, with the time left at the pace so far."""

    def __init__(self) -> None:
        self.what, self.first, self.began, self.printed = "", 0, 0.0, 0.0
        self.last = (-1, -1)

    def __call__(self, what: str, done: int, total: int) -> None:
        now = time.monotonic()
        if what != self.what:
            self.what, self.first, self.began = what, done, now
        elif (done, total) == self.last or (done < total and now - self.printed < LINE_EVERY_S):
            return
        self.printed, self.last = now, (done, total)
        left = ""
        if self.first < done < total:
            seconds = (now - self.began) / (done - self.first) * (total - done)
            left = f", about {seconds:.0f} s left" if seconds < 600 else f", about {seconds / 60:.0f} min left"
        print_err(f"{what} {done} of {total}{left}")
