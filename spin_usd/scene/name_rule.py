"""Rules by which a user says what surfaces of certain names are: the first whose pattern matches counts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TypeVar


@dataclass(frozen=True, kw_only=True)
class NameRule:
    """A rule for surfaces of certain names."""

    pattern: str
    """Of names, with *, ? and [...], in capitals or not."""

    def matches(self, names: Iterable[str]) -> bool:
        """Return whether the pattern matches one of the names, or is one: some names hold brackets."""
        pattern = self.pattern.lower()
        return any(name.lower() == pattern or fnmatchcase(name.lower(), pattern) for name in names)


Rule = TypeVar("Rule", bound=NameRule)


def first_match(rules: Sequence[Rule], names: Iterable[str]) -> Rule | None:
    """Return the first of the `rules` that matches one of the names, if any does."""
    listed = tuple(names)
    return next((rule for rule in rules if rule.matches(listed)), None)


@dataclass(frozen=True, kw_only=True)
class PartRule(NameRule):
    """Which part they belong to."""

    part: str
    """The part's name."""
    class_name: str | None = None
    """None for the class that it has already."""


KEEP = "keep"
Color = tuple[float, float, float]
"""Linear, Rec. 709."""


@dataclass(frozen=True, kw_only=True)
class MaterialRule(NameRule):
    """Which material of the library they have."""

    material: str
    """Its name, or KEEP for the one that the model has."""
    color: Color | None = None
    """None for the material's own."""
    scale: float = 1.0
    """The size of its pattern, in that which it has in the library."""
    note: str = ""
    """Why, for people."""
