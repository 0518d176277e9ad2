"""Bars of progress on a terminal, with rate and time left. This file loads rich: import it where it is used."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, Task, TextColumn
from rich.progress import Progress as RichProgress
from rich.text import Text

from spin_usd.basics.progress import Progress

NARROW = 60  # columns of a terminal that has no room for the bar and the rate
RATE_OVER_S = 600.0  # a picture may take minutes


class RateColumn(ProgressColumn):
    """How many are done in a second, or how many seconds each takes."""

    def render(self, task: Task) -> Text:
        """Return the rate of the task; nothing before it is known."""
        speed = task.finished_speed or task.speed
        if not speed:
            return Text("")
        return Text(f"{speed:.1f} per s" if speed >= 1 else f"{1 / speed:.1f} s each", style="cyan")


class TimeLeftColumn(ProgressColumn):
    """The time left at the pace so far; at the end the time taken."""

    def render(self, task: Task) -> Text:
        """Return the time in hours, minutes and seconds; dashes before it is known."""
        if task.finished_time is not None:
            return Text(f"in  {timedelta(seconds=round(task.finished_time))}")
        left = task.time_remaining
        return Text(f"ETA {'-:--:--' if left is None else timedelta(seconds=round(left))}", style="bold")


@contextmanager
def bars() -> Iterator[Progress]:
    """Give a function that reports progress; each thing that is counted has a bar, until the work ends."""
    console = Console(stderr=True)
    with RichProgress(
        *_columns(console.width), console=console, transient=True, speed_estimate_period=RATE_OVER_S
    ) as shown:
        tasks = {}

        def report(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = shown.add_task(what, total=total, completed=done)
            shown.update(tasks[what], completed=done, total=total)

        yield report


def _columns(width: int) -> tuple[ProgressColumn, ...]:
    what, count = TextColumn("{task.description}", markup=False), MofNCompleteColumn()
    if width < NARROW:
        return what, count, TimeLeftColumn()
    return what, BarColumn(bar_width=None), count, RateColumn(), TimeLeftColumn()
