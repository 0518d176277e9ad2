"""A user's rules for surfaces of certain names: the first whose pattern matches counts."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Generic, TypeVar

WILD = set("*?[")


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


class Rules(Generic[Rule]):
    """Rules in their order, of which one for a name is found without trying all: a model may have thousands."""

    def __init__(self, rules: Iterable[Rule]) -> None:
        self._rules = tuple(rules)
        self._plain: dict[str, int] = {}
        for place, rule in enumerate(self._rules):
            self._plain.setdefault(rule.pattern.lower(), place)
        self._wild = [place for place, rule in enumerate(self._rules) if set(rule.pattern) & WILD]

    def first(self, names: Sequence[str]) -> Rule | None:
        """Return the first rule that matches one of the names, if any does."""
        plain = (self._plain.get(name.lower()) for name in names)
        wild = (place for place in self._wild if self._rules[place].matches(names))
        found = [place for place in (*plain, next(wild, None)) if place is not None]
        return self._rules[min(found)] if found else None


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
    """Size of its pattern, relative to the library's."""
    note: str = ""
    """Why, for people."""
