"""Rules by which a user names the parts of a model: the first whose pattern matches counts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase


@dataclass(frozen=True, kw_only=True)
class PartRule:
    """Which part surfaces of certain names belong to."""

    pattern: str
    """Of names, with *, ? and [...], in capitals or not."""
    part: str
    """The part's name."""
    class_name: str | None = None
    """None for the class that it has already."""

    def matches(self, names: Iterable[str]) -> bool:
        """Return whether the pattern matches one of the names, or is one: some names hold brackets."""
        pattern = self.pattern.lower()
        return any(name.lower() == pattern or fnmatchcase(name.lower(), pattern) for name in names)


def first_match(rules: Sequence[PartRule], names: Iterable[str]) -> PartRule | None:
    """Return the first of the `rules` that matches one of the names, if any does."""
    listed = tuple(names)
    return next((rule for rule in rules if rule.matches(listed)), None)
