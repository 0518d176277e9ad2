"""A pool of children that work at once: what they say, and that they died or hang, comes as events in one queue."""

import selectors
import time
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, Self, TypeVar

from spin_usd.dataset.process.child import Child, ChildDiedError, ChildInternalError
from spin_usd.dataset.process.limits import HANG_S
from spin_usd.errors import SpinError

LOOK_S = 1.0  # between two looks at whether a child hangs

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True, kw_only=True)
class Reported(Generic[Key]):
    """The child `key` reports progress: the arguments of a callback."""

    key: Key
    message: Sequence[Any]


@dataclass(frozen=True, kw_only=True)
class Answered(Generic[Key]):
    """The child `key` has done what it was asked, and is idle."""

    key: Key
    result: Any


@dataclass(frozen=True, kw_only=True)
class Failed(Generic[Key]):
    """The child `key` could not do what it was asked, and is idle; where `reason` is a ChildDiedError it is gone."""

    key: Key
    reason: SpinError | ChildInternalError


@dataclass(kw_only=True, eq=False)
class _Member(Generic[Key]):
    """A child of the pool; `since`: when it was last heard of while it is at work, None while it is idle."""

    key: Key
    child: Child
    since: float | None = None


class Pool(Generic[Key]):
    """Children by keys of the caller's choice. A child at work that says nothing for `hang_s` seconds is killed.

    All children that are left are killed when the pool's block ends.
    """

    def __init__(self, *, hang_s: float = HANG_S) -> None:
        self.hang_s = hang_s
        self._members: dict[Key, _Member[Key]] = {}
        self._selector = selectors.DefaultSelector()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for key in list(self._members):
            self.kill(key)
        self._selector.close()

    def __len__(self) -> int:
        return len(self._members)

    def __contains__(self, key: object) -> bool:
        return key in self._members

    def add(self, key: Key, child: Child, *, at_work: bool = False) -> None:
        """Take `child` into the pool; `at_work`: it was already asked something."""
        member = _Member(key=key, child=child, since=time.monotonic() if at_work else None)
        self._members[key] = member
        self._selector.register(child, selectors.EVENT_READ, member)

    def send(self, key: Key, call: str, **arguments: Any) -> None:
        """Ask an idle child to do `call`; the answer comes as an event, and so does its death."""
        member = self._members[key]
        member.since = time.monotonic()
        with suppress(ChildDiedError):  # the end of a dead child's answers is an event too
            member.child.send(call, **arguments)

    def idle(self) -> list[Key]:
        """Return the keys of the children that wait to be asked."""
        return [key for key, member in self._members.items() if member.since is None]

    def wait(self) -> Iterator[Reported[Key] | Answered[Key] | Failed[Key]]:
        """Wait for children to say something, at most LOOK_S; yield what they say, and who died or hangs."""
        for ready, _ in self._selector.select(timeout=min(LOOK_S, self.hang_s)):
            if self._holds(ready.data):
                yield from self._read(ready.data)
        for member in list(self._members.values()):
            if self._holds(member) and self._hangs(member):
                self.kill(member.key)
                reason = ChildDiedError(f"the worker process gave no answer within {self.hang_s:g} s")
                yield Failed(key=member.key, reason=reason)

    def close(self, key: Key) -> None:
        """Let the idle child `key` end by itself."""
        self._remove(key).close()

    def kill(self, key: Key) -> None:
        """End the child `key` at once."""
        self._remove(key).kill()

    def _holds(self, member: _Member[Key]) -> bool:
        """Return whether the member is still there: the caller may have ended or replaced it meanwhile."""
        return self._members.get(member.key) is member

    def _hangs(self, member: _Member[Key]) -> bool:
        return member.since is not None and time.monotonic() - member.since > self.hang_s

    def _remove(self, key: Key) -> Child:
        child = self._members.pop(key).child
        self._selector.unregister(child)
        return child

    def _read(self, member: _Member[Key]) -> Iterator[Reported[Key] | Answered[Key] | Failed[Key]]:
        try:
            for message in member.child.received():
                yield self._event(member, message)
        except ChildDiedError as died:
            self.kill(member.key)
            yield Failed(key=member.key, reason=died)
        except (SpinError, ChildInternalError) as reason:
            member.since = None
            yield Failed(key=member.key, reason=reason)

    def _event(self, member: _Member[Key], message: Mapping[str, Any]) -> Reported[Key] | Answered[Key]:
        if "progress" in message:
            member.since = time.monotonic()
            return Reported(key=member.key, message=message["progress"])
        member.since = None
        return Answered(key=member.key, result=message["result"])
