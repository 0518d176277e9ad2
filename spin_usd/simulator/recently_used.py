"""Things kept in memory as long as they fit, those that were used last."""

from collections import OrderedDict
from typing import Generic, TypeVar

T = TypeVar("T")


class RecentlyUsed(Generic[T]):
    """Things by their keys, together of at most so many bytes, or one."""

    def __init__(self, most: int) -> None:
        self._most, self._held = most, 0
        self._things: OrderedDict[str, tuple[T, int]] = OrderedDict()

    def find(self, key: str) -> T | None:
        """Return the thing, which is used now; None where it is not kept."""
        if key not in self._things:
            return None
        self._things.move_to_end(key)
        return self._things[key][0]

    def keep(self, key: str, thing: T, size: int) -> None:
        """Keep a thing of `size` bytes, and let go those that were not used for longest."""
        _, before = self._things.pop(key, (None, 0))
        self._things[key] = thing, size
        self._held += size - before
        while self._held > self._most and len(self._things) > 1:
            _, (_, gone) = self._things.popitem(last=False)
            self._held -= gone
