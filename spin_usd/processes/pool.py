"""A pool of children that work at once: their messages come as events in a queue, and so do deaths, runaways, hangs and
growth."""

import selectors
import time
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, Protocol, Self, TypeVar

from spin_usd.errors import SpinError
from spin_usd.processes.call import Call, Request
from spin_usd.processes.child import ChildInternalError
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.patience import LOOK_S, Patience

Key = TypeVar("Key", bound=Hashable)


class ChildProtocol(Protocol):
    """A child that gets a call and answers in its own time, here or on another machine; see the methods of `Child`."""

    def fileno(self) -> int: ...

    def send(self, call: Call[Request, Any], request: Request) -> None: ...

    def received(self) -> Iterator[Mapping[str, Any]]: ...

    def close(self) -> None: ...

    def kill(self) -> None: ...

    def interrupt(self) -> None: ...

    def overdue(self, patience: Patience) -> ChildDiedError | None: ...

    def outgrown(self, limit: int) -> ChildDiedError | None: ...


@dataclass(frozen=True, kw_only=True)
class Reported(Generic[Key]):
    """The child `key` reports progress: the arguments of a callback."""

    key: Key
    message: Sequence[Any]


@dataclass(frozen=True, kw_only=True)
class Answered(Generic[Key]):
    """The child `key` has answered its call, and is idle."""

    key: Key
    result: Any


@dataclass(frozen=True, kw_only=True)
class Failed(Generic[Key]):
    """The child `key` could not answer its call, and is idle; where `reason` is a ChildDiedError it is gone."""

    key: Key
    reason: SpinError | ChildInternalError


PoolEvent = Reported[Key] | Answered[Key] | Failed[Key]


@dataclass(kw_only=True, eq=False)
class _Member(Generic[Key]):
    """A child of the pool, with the timeout of its next message; None while it is idle."""

    key: Key
    child: ChildProtocol
    patience: Patience | None = None

    def give(self, within_s: float) -> None:
        """Give it `within_s` seconds from now for its next message."""
        self.patience = Patience(within_s)


class Pool(Generic[Key]):
    """Children by keys of the caller's choice. A busy one that takes more for its next message than its limit, as
    Patience counts the seconds, or holds more than `memory` bytes, is killed.

    All children that are left are killed when the pool's block ends.
    """

    def __init__(self, *, memory: int | None = None) -> None:
        self.memory = memory
        self._members: dict[Key, _Member[Key]] = {}
        self._selector = selectors.DefaultSelector()
        self._looked = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for key in list(self._members):
            self.kill(key)
        self._selector.close()

    def __len__(self) -> int:
        return len(self._members)

    def __iter__(self) -> Iterator[Key]:
        return iter(list(self._members))  # the caller may end some meanwhile

    def __contains__(self, key: object) -> bool:
        return key in self._members

    def add(self, key: Key, child: ChildProtocol, *, within_s: float | None = None) -> None:
        """Take `child` into the pool; with `within_s` it was already sent a call, and has that long."""
        member = _Member(key=key, child=child, patience=None if within_s is None else Patience(within_s))
        self._members[key] = member
        self._selector.register(child, selectors.EVENT_READ, member)

    def send(self, key: Key, call: Call[Request, Any], request: Request, *, within_s: float) -> None:
        """Send a call to an idle child, with `within_s` seconds for each message from it; the answer comes as an event,
        and so does its death."""
        member = self._members[key]
        member.give(within_s)
        with suppress(ChildDiedError):  # the end of a dead child's answers is an event too
            member.child.send(call, request)

    def give(self, key: Key, within_s: float) -> None:
        """Give the busy child `key` `within_s` seconds from now for its next message."""
        self._members[key].give(within_s)

    def idle(self) -> list[Key]:
        """Return the keys of the idle children."""
        return [key for key, member in self._members.items() if member.patience is None]

    def fileno(self) -> int:
        """Readable when a child sends a message, or ends."""
        return self._selector.fileno()

    def wait(self, *, within_s: float = LOOK_S) -> Iterator[PoolEvent[Key]]:
        """Wait at most so long; yield the messages of children, and the deaths, runaways, hangs and growth."""
        for ready, _ in self._selector.select(timeout=within_s):
            if self._holds(ready.data):
                yield from self._read(ready.data)
        if time.monotonic() - self._looked >= LOOK_S:
            self._looked = time.monotonic()
            for member in list(self._members.values()):
                if self._holds(member) and (died := self._ended(member)):
                    yield Failed(key=member.key, reason=died)

    def close(self, key: Key) -> None:
        """Let the idle child `key` end by itself."""
        self._remove(key).close()

    def kill(self, key: Key) -> None:
        """End the child `key` at once."""
        self._remove(key).kill()

    def interrupt(self) -> None:
        """End all children, from another thread than the one that waits for them, which learns of it."""
        for member in list(self._members.values()):
            member.child.interrupt()

    def _holds(self, member: _Member[Key]) -> bool:
        """Return whether the member is still there: the caller may have ended or replaced it meanwhile."""
        return self._members.get(member.key) is member

    def _ended(self, member: _Member[Key]) -> ChildDiedError | None:
        """End a busy child that ran away, hangs or grew too large, and return the error; None for any other."""
        if member.patience is None:
            return None
        died = member.child.overdue(member.patience)
        if died is None and self.memory is not None:
            died = member.child.outgrown(self.memory)
        if died:
            self._remove(member.key)
        return died

    def _remove(self, key: Key) -> ChildProtocol:
        child = self._members.pop(key).child
        self._selector.unregister(child)
        return child

    def _read(self, member: _Member[Key]) -> Iterator[PoolEvent[Key]]:
        try:
            for message in member.child.received():
                yield self._event(member, message)
        except ChildDiedError as died:
            self.kill(member.key)
            yield Failed(key=member.key, reason=died)
        except (SpinError, ChildInternalError) as reason:
            member.patience = None
            yield Failed(key=member.key, reason=reason)

    def _event(self, member: _Member[Key], message: Mapping[str, Any]) -> Reported[Key] | Answered[Key]:
        if "progress" in message:
            if member.patience:
                member.give(member.patience.limit_s)
            return Reported(key=member.key, message=message["progress"])
        member.patience = None
        return Answered(key=member.key, result=message["result"])
