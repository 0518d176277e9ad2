"""How often a piece of work is tried again whose child process died."""

from collections import Counter
from collections.abc import Mapping

from spin_usd.dataset.process.child import ChildDiedError, DeathCause

TRIES: Mapping[DeathCause, int] = {
    DeathCause.CRASHED: 2,
    DeathCause.KILLED: 5,  # from outside: hardly the work's own fault
    DeathCause.LOST: 10,  # nodes come and go; but one picture after which ten went has a hand in it
    DeathCause.GREW: 2,
    DeathCause.SILENT: 2,
}
"""A piece of work is given up when children died of it so often for one cause: that is no accident any more."""

READING_TRIES: Mapping[DeathCause, int] = {**TRIES, DeathCause.GREW: 1, DeathCause.SILENT: 1}
"""The same for work that reads: what takes all memory or all time does so again."""


class Retries:
    """The retries of one piece of work whose children die. `tries`: how many deaths of each cause are too many."""

    def __init__(self, tries: Mapping[DeathCause, int] = TRIES) -> None:
        self._tries = tries
        self._counts = Counter[DeathCause]()

    def may_try_again(self, died: ChildDiedError) -> bool:
        """Count one more death; return whether the work is worth another try."""
        self._counts[died.cause] += 1
        return self._counts[died.cause] < self._tries[died.cause]

    def in_words(self, died: ChildDiedError) -> str:
        """Say of what the last child died, and how many died so."""
        count = self._counts[died.cause]
        if count == 1:
            return died.found
        return f"{died.found}, twice" if count == 2 else f"{died.found}, {count} times"
