"""Things kept in memory as long as they fit, the most recently used ones."""

from collections import OrderedDict
from collections.abc import Hashable
from typing import Generic, TypeVar

T = TypeVar("T")


class RecentlyUsed(Generic[T]):
    """Things by their keys, at most `most` of them, or as many bytes if they have a size; one at least."""

    def __init__(self, most: int) -> None:
        self._most, self._held = most, 0
        self._things: OrderedDict[Hashable, tuple[T, int]] = OrderedDict()

    def find(self, key: Hashable) -> T | None:
        """Return the thing and note its use; None if it is not kept."""
        if key not in self._things:
            return None
        self._things.move_to_end(key)
        return self._things[key][0]

    def keep(self, key: Hashable, thing: T, size: int = 1) -> None:
        """Keep a thing, and drop the least recently used ones."""
        _, before = self._things.pop(key, (None, 0))
        self._things[key] = thing, size
        self._held += size - before
        while self._held > self._most and len(self._things) > 1:
            _, (_, gone) = self._things.popitem(last=False)
            self._held -= gone
