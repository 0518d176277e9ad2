"""A child process for many calls: where one dies, the next call has another."""

from types import TracebackType
from typing import Any, Self

from spin_usd.processes.ask_child import unreadable
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.deaths import ChildDiedError


class LastingChild:
    """Calls one child after another; none is started before it is needed, or `start` is called. `memory` and `modules`
    are those of Child."""

    def __init__(self, *, memory: int | None = None, modules: tuple[str, ...] = ()) -> None:
        self._memory, self._modules = memory, modules
        self._child: Child | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._child is not None:
            self._child.__exit__(kind, error, trace)

    def start(self) -> Child:
        """Start a child, unless there is one; return it."""
        self._child = self._child or Child(memory=self._memory, modules=self._modules)
        return self._child

    def call(self, call: str, *, within_s: float = PATIENCE_S, **arguments: Any) -> Any:
        """Return what `call` returns in the child, within `within_s` seconds. Raises what the child raises, and
        ChildDiedError where it dies."""
        try:
            return self.start().call(call, within_s=within_s, **arguments)
        except ChildDiedError:
            self.end()
            raise

    def read(self, call: str, *, reads: object, **arguments: Any) -> Any:
        """Return what `call` returns in the child, which reads the file `reads`. Raises what the child raises, and
        StageError or RenderError that names the file where it dies."""
        try:
            return self.call(call, **arguments)
        except ChildDiedError as died:
            raise unreadable(died, reads) from died

    def interrupt(self) -> None:
        """End the child, from another thread than that which waits for it: its call raises ChildDiedError."""
        if (child := self._child) is not None:
            child.interrupt()

    def end(self) -> None:
        """End the child at once, if there is one."""
        if self._child is not None:
            self._child.kill()
        self._child = None
