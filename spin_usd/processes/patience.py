"""The timeout of a child's next message, which counts the child's work, not the clock."""

import logging
import time
from functools import cache

from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.usage import Usage

LOOK_S = 0.5  # between two looks at a child's usage
STOPPED_S = 5.0  # after which a stopped worker is reported


class Patience:
    """The timeout of a child: `limit_s` seconds of processor time of its busiest thread for its next message, and as
    many idle seconds. Time in which it waits for a processor or is stopped does not count; a warning of this module's
    logger reports it once."""

    def __init__(self, limit_s: float) -> None:
        self.limit_s = limit_s
        self._before: Usage | None = None
        self._began = time.monotonic()

    def exhausted(self, usage: Usage, worker: str) -> ChildDiedError | None:
        """Return the error for a child of this usage if it has run away or hangs, else None.

        Later usages count from the first one. `worker`: name of the child for the user.
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
    """Log it once."""
    logging.getLogger(__name__).warning(sentence)
