"""A child process for a whole session: where one dies, the next call has another."""

from types import TracebackType
from typing import Any, Self

from spin_usd.dataset.process.ask_child import unreadable
from spin_usd.dataset.process.child import Child, ChildDiedError


class LastingChild:
    """Calls one child after another; none is started before it is needed."""

    def __init__(self) -> None:
        self._child: Child | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._child is not None:
            self._child.__exit__(kind, error, trace)

    def call(self, call: str, *, reads: object, **arguments: Any) -> Any:
        """Return what `call` returns in the child. `reads`: the file that it does, for messages. Raises what the child
        raises, and StageError or RenderError where it dies."""
        child = self._child = self._child or Child()
        try:
            return child.call(call, **arguments)
        except ChildDiedError as died:
            child.kill()
            self._child = None
            raise unreadable(died, reads) from died
