"""The connection to a worker's actor in a thread of this process: for pictures that are published elsewhere."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from spin_usd.processes.cluster.worker_actor import Message, WorkerActor, WorkerOpening
from spin_usd.processes.deaths import ChildDiedError


class LocalConnection:
    """An actor in this process, opened with `opening`."""

    def __init__(self, opening: WorkerOpening) -> None:
        self._opening, self._actor = opening, WorkerActor()
        self._threads = ThreadPoolExecutor(max_workers=1)

    def open(self) -> "Future[list[Message]]":
        return self._threads.submit(self._actor.open, self._opening)

    def send(self, call: str, arguments: Mapping[str, Any]) -> None:
        with suppress(ChildDiedError):  # `receive` says so too
            self._actor.send(call, arguments)

    def receive(self) -> "Future[list[Message]]":
        return self._threads.submit(self._actor.receive)

    def close(self) -> None:
        self._actor.close()
        self._threads.shutdown()

    def kill(self) -> None:
        self._actor.kill()
        self._threads.shutdown(wait=False)
