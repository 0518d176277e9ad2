"""What a pool needs of a child, whether it is a process here or on another machine."""

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

from spin_usd.dataset.process.child import ChildDiedError


class ChildProtocol(Protocol):
    """A child that is asked and answers in its own time; `Child` says what each method does."""

    def fileno(self) -> int: ...

    def send(self, call: str, **arguments: Any) -> None: ...

    def received(self) -> Iterator[Mapping[str, Any]]: ...

    def close(self) -> None: ...

    def kill(self) -> None: ...

    def silenced(self, within_s: float) -> ChildDiedError: ...

    def outgrown(self, limit: int) -> ChildDiedError | None: ...
