"""Names made unlike one another by numbers: the one way to it.

Each name has a counter of its own, so that a million repeats of one take no longer than a million names.
"""

from collections.abc import Iterable
from dataclasses import InitVar, dataclass, field


@dataclass
class UniqueNames:
    """Gives names that it did not give before."""

    first: int = 2
    """The number that the first repeat of a name gets."""
    cased: bool = False
    """Whether names that differ only in case are different, which depends on the file system."""
    taken: InitVar[Iterable[str]] = ()
    """Names that are somebody else's."""
    _next: dict[str, int] = field(default_factory=dict, init=False)

    def __post_init__(self, taken: Iterable[str]) -> None:
        self._taken = set(map(self._key, taken))

    def give(self, name: str, suffix: str = "") -> str:
        """Return `name` before its suffix, numbered where it was given before."""
        found, base = name + suffix, self._key(name + suffix)
        while self._key(found) in self._taken:
            number = self._next.get(base, self.first)
            self._next[base] = number + 1
            found = f"{name}_{number}{suffix}"
        self._taken.add(self._key(found))
        return found

    def _key(self, name: str) -> str:
        return name if self.cased else name.lower()
