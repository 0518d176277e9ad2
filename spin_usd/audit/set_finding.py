"""A fault of a data set: which pictures have it, what would be right, and what would mend it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from spin_usd.audit.readings import Reading
from spin_usd.scene.finding import ERROR, Finding

NAMED = 3


@dataclass(frozen=True, kw_only=True)
class Repair:
    """A change of a whole set's poses that puts its labels right."""

    reading: Reading | None = None
    """The reading of poses that the set follows; None for the layout's own."""
    length: float = 1.0
    """Factor on positions."""
    names: Mapping[str, str] = field(default_factory=dict)
    """Paths of images by the names that lists give them."""
    lists: frozenset[str] = frozenset()
    """Lists that it is for; empty for all."""


@dataclass(frozen=True, kw_only=True)
class SetFinding:
    """A fault of one kind."""

    rule: str
    message: str
    """The fault, as the end of a sentence about the set."""
    remedy: str
    pictures: Sequence[str] = ()
    """Names of the pictures that have it, the worst first; empty if it is of the set."""
    of: int = 0
    """Number of pictures that were examined."""
    where: str = ""
    """The list that has it, if it is not of pictures."""
    severity: str = ERROR
    repair: Repair | None = None
    """Change that mends it, if one is known."""

    def finding(self, root: str) -> Finding:
        """Return it as one of a report on the set at `root`."""
        count = f"{len(self.pictures)} of {self.of} pictures: " if self.of else ""
        others = list(self.pictures[1:NAMED])
        also = f" (also {', '.join(others)}{', ...' if len(self.pictures) > NAMED else ''})" if others else ""
        where = self.where or next(iter(self.pictures), root)
        message = f"{count}{self.message}{also}; {self.remedy}"
        return Finding(code=self.rule, where=where, message=message, severity=self.severity)


def worst_first(named: Iterable[tuple[str, float]]) -> list[str]:
    """Return names, each once, in the order of falling numbers."""
    return list(dict.fromkeys(name for name, _ in sorted(named, key=lambda each: -each[1])))
