"""Why a child process ended before it answered, and how often work is tried again after that."""

from collections import Counter
from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType

from spin_usd.errors import RenderError


class DeathCause(StrEnum):
    """The cause of a child's end before it answered: a crash of its own, something outside that killed or stopped it,
    its machine lost to the cluster, too much memory, more processor time than its limit, or none for too long."""

    CRASHED = "crashed"
    KILLED = "killed"
    LOST = "lost"
    GREW = "grew"
    RAN_AWAY = "ran away"
    HUNG = "hung"


class ChildDiedError(RenderError):
    """The child process ended before it answered, for this `cause`."""

    def __init__(self, found: str, *, cause: DeathCause) -> None:
        super().__init__(found)
        self.cause = cause


TRIES: Mapping[DeathCause, int] = MappingProxyType(
    {
        DeathCause.CRASHED: 2,
        DeathCause.KILLED: 5,  # from outside: rarely the work's own fault
        DeathCause.LOST: 10,  # nodes come and go; but a picture that lost ten is the likely cause
        DeathCause.GREW: 2,
        DeathCause.RAN_AWAY: 2,
        DeathCause.HUNG: 2,
    }
)
"""Deaths of each cause after which a piece of work is given up: it is no accident any more."""

READING_TRIES: Mapping[DeathCause, int] = MappingProxyType(
    {**TRIES, DeathCause.GREW: 1, DeathCause.RAN_AWAY: 1, DeathCause.HUNG: 1}
)
"""The same for work that reads: a file that took all memory or time does so again."""


ONCE: Mapping[DeathCause, int] = MappingProxyType(dict.fromkeys(DeathCause, 1))
"""The same for work that is never tried again."""


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
        """Return a text on the last child's death, and how many died of that cause."""
        count = self._counts[died.cause]
        if count == 1:
            return died.found
        return f"{died.found}, twice" if count == 2 else f"{died.found}, {count} times"
