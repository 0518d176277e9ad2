"""A worker behind an actor, on another machine or in a thread, which a pool treats like a child process."""

import os
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any, Protocol

from spin_usd.processes.call import Call, Request
from spin_usd.processes.child import returned
from spin_usd.processes.cluster.worker_actor import Message, WorkerActor, WorkerOpening
from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.patience import Patience
from spin_usd.processes.readable import readable
from spin_usd.processes.usage import Usage


class ActorConnection(Protocol):
    """The connection to a worker's actor. Its answers come later; a ChildDiedError if the actor has gone."""

    def open(self) -> "Future[list[Message]]":
        """Open the actor, once there is a machine for it."""

    def send(self, call: Call[Request, Any], request: Request) -> None:
        """Send the worker a call."""

    def receive(self) -> "Future[list[Message]]":
        """Wait for the worker's next messages."""

    def close(self) -> None:
        """Let the idle worker end by itself, sooner or later."""

    def kill(self) -> None:
        """End the worker at once."""


class RemoteChild:
    """A pool's child with the methods of `Child`; it was sent the opening call."""

    def __init__(self, connection: ActorConnection) -> None:
        self._connection = connection
        self._heard: deque[Message | BaseException] = deque()
        self._readable, self._writable = os.pipe()  # it contains a byte for each message received
        self._lock, self._ended = threading.Lock(), False
        self._heard_at = time.monotonic()
        self._usage: Usage | None = None  # as its actor reported it last
        self._opened = connection.open()
        self._opened.add_done_callback(self._take)

    def fileno(self) -> int:
        """Readable when there is something to `receive`."""
        return self._readable

    def send(self, call: Call[Request, Any], request: Request) -> None:
        """Send the worker a call; the answer comes through `receive`, and so does its death."""
        self._connection.send(call, request)

    def receive(self) -> Mapping[str, Any]:
        """Receive the next message. Raises the error of the worker, or ChildDiedError."""
        os.read(self._readable, 1)
        message = self._heard.popleft()
        if isinstance(message, BaseException):
            raise message
        if "died" in message:
            raise ChildDiedError(message["died"]["found"], cause=DeathCause(message["died"]["cause"]))
        return returned(message)

    def received(self) -> Iterator[Mapping[str, Any]]:
        """Yield the results of `receive`, at least one, and more as long as none needs waiting."""
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

    def interrupt(self) -> None:
        """End the worker at once, from another thread than the one that waits for it."""
        self._connection.kill()

    def overdue(self, patience: Patience) -> ChildDiedError | None:
        """End the worker if it has run away or hangs, by the reports of its actor, or if no message comes; return the
        error for it."""
        died = self._missed(patience.limit_s)
        if died is None and self._usage is not None:
            died = patience.exhausted(self._usage, "a worker process on another machine")
        if died:
            self.kill()
        return died

    def _missed(self, limit_s: float) -> ChildDiedError | None:
        """Return the error for a worker that has no machine yet, or whose machine was silent for so long."""
        if time.monotonic() - self._heard_at <= limit_s:
            return None
        if self._opened.done():
            return ChildDiedError(f"the worker's machine sent nothing for {limit_s:g} s", cause=DeathCause.HUNG)
        return ChildDiedError(f"no processor was free for a worker within {limit_s:g} s", cause=DeathCause.LOST)

    def outgrown(self, limit: int) -> ChildDiedError | None:
        """Its actor ends it where it grows."""
        return None

    def _take(self, said: "Future[list[Message]]") -> None:
        """Store the messages, and wait for the next ones."""
        if error := said.exception():
            self._hear(error)
            return
        self._heard_at = time.monotonic()
        for message in said.result():
            if "usage" in message:
                self._usage = Usage(**message["usage"])
            else:
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


class LocalConnection:
    """An actor in this process, opened with `opening`."""

    def __init__(self, opening: WorkerOpening) -> None:
        self._opening, self._actor = opening, WorkerActor()
        self._threads = ThreadPoolExecutor(max_workers=1)

    def open(self) -> "Future[list[Message]]":
        return self._threads.submit(self._actor.open, self._opening)

    def send(self, call: Call[Request, Any], request: Request) -> None:
        with suppress(ChildDiedError):  # `receive` reports it too
            self._actor.send(call, request)

    def receive(self) -> "Future[list[Message]]":
        return self._threads.submit(self._actor.receive)

    def close(self) -> None:
        self._actor.close()
        self._threads.shutdown()

    def kill(self) -> None:
        self._actor.kill()
        self._threads.shutdown(wait=False)
