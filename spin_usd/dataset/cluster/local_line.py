"""The line to a worker's host that is a thread of this process: for pictures that are published elsewhere."""

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from spin_usd.dataset.cluster.worker_host import Message, WorkerHost, WorkerOpening
from spin_usd.dataset.process.child import ChildDiedError


class LocalLine:
    """A host in this process, opened with `opening`."""

    def __init__(self, opening: WorkerOpening) -> None:
        self._opening, self._host = opening, WorkerHost()
        self._threads = ThreadPoolExecutor(max_workers=1)

    def open(self) -> "Future[list[Message]]":
        return self._threads.submit(self._host.open, self._opening)

    def send(self, call: str, arguments: Mapping[str, Any]) -> None:
        with suppress(ChildDiedError):  # `receive` says so too
            self._host.send(call, arguments)

    def receive(self) -> "Future[list[Message]]":
        return self._threads.submit(self._host.receive)

    def close(self) -> None:
        self._host.close()
        self._threads.shutdown()

    def kill(self) -> None:
        self._host.kill()
        self._threads.shutdown(wait=False)
