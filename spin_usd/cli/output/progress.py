"""Progress of long operations on standard error: a bar with an ETA on a terminal, a line now and then elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from spin_usd.cli.output.lines import tell

LINE_EVERY_S = 10.0


@contextmanager
def shown(quiet: bool = False) -> Iterator[Callable[[str, int, int], None]]:
    """Give a function that reports progress: what is done and counted, such as "rendering: picture", how many are
    done, how many there are."""
    if quiet:
        yield lambda what, done, total: None
    elif sys.stderr.isatty():
        with _bar() as report:
            yield report
    else:
        yield _Lines()


@contextmanager
def _bar() -> Iterator[Callable[[str, int, int], None]]:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("ETA"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks = {}

        def report(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=total, completed=done)
            bar.update(tasks[what], completed=done, total=total)

        yield report


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
        tell(f"{what} {done} of {total}{left}")
