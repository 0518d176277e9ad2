"""How long a child may take for its next word: a limit counts what the child does, and not the clock."""

import logging
import time
from functools import cache

from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.usage import Usage

LOOK_S = 0.5  # between two looks at what a child does
STOPPED_S = 5.0  # after which it is said that a worker is stopped


class Patience:
    """The patience with a child that has `limit_s` seconds of processor time for its next word, those of its busiest
    thread, and as many in which it is idle. What it waits for a processor or is stopped counts for nothing; that is
    said once, as a warning of the logger of this module."""

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self._before: Usage | None = None
        self._began = time.monotonic()

    def exhausted(self, usage: Usage, worker: str) -> ChildDiedError | None:
        """Return what to say of the child whose usage this is where it has run away or hangs, None for any other.

        The first usage is what later ones are counted from. `worker`: how a person finds the child.
        """
        if self._before is None:
            self._before, self._began = usage, time.monotonic()
            return None
        used = usage.since(self._before)
        if used.busy_s > self.limit_s:
            found = f"used {used.busy_s:.3g} s of processor time, more than its limit of {self.limit_s:g} s"
            return ChildDiedError(f"the worker process {found}", cause=DeathCause.RAN_AWAY)
        if used.idle_s > self.limit_s:
            found = f"the worker process used no processor time for {used.idle_s:.3g} s"
            return ChildDiedError(found, cause=DeathCause.HUNG)
        clock = time.monotonic() - self._began
        if used.stopped_s > STOPPED_S:
            _say(f"{worker} is stopped, which costs it nothing but time; it goes on after kill -CONT")
        elif clock > self.limit_s and used.busy_s + used.idle_s + used.stopped_s < clock / 2:
            _say("the machine is busy: workers wait for a processor or a disk, which counts for no time limit")
        return None


@cache
def _say(sentence: str) -> None:
    """Say it once."""
    logging.getLogger(__name__).warning(sentence)
