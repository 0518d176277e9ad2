"""Values that are computed again only if their inputs have changed since the previous picture."""

from collections.abc import Callable
from operator import is_
from typing import Generic, TypeVar

T = TypeVar("T")


class IdentityMemo(Generic[T]):
    """A value that depends on some objects, kept as long as they are the same."""

    def __init__(self) -> None:
        self._last: tuple[tuple[object, ...], T] | None = None

    def of(self, objects: tuple[object, ...], make: Callable[[], T]) -> T:
        """Return the result of `make`, which depends on the `objects` alone; the last one again where all of them are
        the very objects that it was made of."""
        last = self._last
        if last is None or len(last[0]) != len(objects) or not all(map(is_, last[0], objects)):
            last = self._last = objects, make()
        return last[1]
