"""A worker behind an actor, on another machine or in a thread, which a pool treats as a child process of its own."""

import os
import threading
from collections import deque
from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from typing import Any, Protocol

from spin_usd.dataset.cluster.worker_actor import Message
from spin_usd.dataset.process.child import ChildDiedError, DeathCause, returned
from spin_usd.dataset.process.readable import readable


class ActorConnection(Protocol):
    """The connection to a worker's actor. Its answers come later; a ChildDiedError where the actor has gone."""

    def open(self) -> "Future[list[Message]]":
        """Open the actor, once there is a machine for it."""

    def send(self, call: str, arguments: Mapping[str, Any]) -> None:
        """Ask the worker to do `call`."""

    def receive(self) -> "Future[list[Message]]":
        """Wait for what the worker says next."""

    def close(self) -> None:
        """Let the idle worker end by itself, sooner or later."""

    def kill(self) -> None:
        """End the worker at once."""


class RemoteChild:
    """What `Child` is to a pool; it was asked to open a worker."""

    def __init__(self, connection: ActorConnection) -> None:
        self._connection = connection
        self._heard: deque[Message | BaseException] = deque()
        self._readable, self._writable = os.pipe()  # it holds a byte for each that was heard
        self._lock, self._ended = threading.Lock(), False
        self._opened = connection.open()
        self._opened.add_done_callback(self._take)

    def fileno(self) -> int:
        """Readable when there is something to `receive`."""
        return self._readable

    def send(self, call: str, **arguments: Any) -> None:
        """Ask the worker to do `call`; the answer comes through `receive`, and so does its death."""
        self._connection.send(call, arguments)

    def receive(self) -> Mapping[str, Any]:
        """Receive the next message. Raises what the worker raised, or ChildDiedError."""
        os.read(self._readable, 1)
        message = self._heard.popleft()
        if isinstance(message, BaseException):
            raise message
        if "died" in message:
            raise ChildDiedError(message["died"]["found"], cause=DeathCause(message["died"]["cause"]))
        return returned(message)

    def received(self) -> Iterator[Mapping[str, Any]]:
        """Yield what `receive` gives, at least once, and again as long as that needs no waiting."""
        yield self.receive()
        while not self._ended and readable(self._readable, 0):
            yield self.receive()

    def close(self) -> None:
        """Let the idle worker end by itself."""
        self._hang_up()
        self._connection.close()

    def kill(self) -> None:
        """End the worker at once."""
        self._hang_up()
        self._connection.kill()

    def silenced(self, within_s: float) -> ChildDiedError:
        """End the worker, which said nothing for so many seconds; return what to say of it."""
        placed = self._opened.done()
        self.kill()
        if placed:
            found = f"the worker process gave no answer within {within_s:g} s"
            return ChildDiedError(found, cause=DeathCause.SILENT)
        return ChildDiedError(f"no processor was free for a worker within {within_s:g} s", cause=DeathCause.LOST)

    def outgrown(self, limit: int) -> ChildDiedError | None:
        """Its actor ends it where it grows."""
        return None

    def _take(self, said: "Future[list[Message]]") -> None:
        """Take in what was said, and listen for what is said next."""
        if error := said.exception():
            self._hear(error)
            return
        for message in said.result():
            self._hear(message)
        at_work = not said.result() if said is self._opened else not any("died" in message for message in said.result())
        if at_work and (next_words := self._asked()):
            next_words.add_done_callback(self._take)

    def _asked(self) -> "Future[list[Message]] | None":
        with self._lock:
            return None if self._ended else self._connection.receive()

    def _hear(self, message: Message | BaseException) -> None:
        with self._lock:
            if not self._ended:
                self._heard.append(message)
                os.write(self._writable, b"\0")

    def _hang_up(self) -> None:
        with self._lock:
            if not self._ended:
                self._ended = True
                os.close(self._readable)
                os.close(self._writable)
