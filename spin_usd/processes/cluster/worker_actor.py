"""The actor beside a worker on its machine: it starts the worker, passes on messages, and publishes its pictures.

It runs on a node of a cluster, or in a thread of the supervisor. It has the user's own rights, and rights to the URL.
The worker, which reads files of strangers, is a child process with a clean environment as ever.
"""

import socket
import time
import traceback
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import Any

from spin_usd.errors import InputError, SpinError
from spin_usd.picture.versions import library_versions
from spin_usd.processes.call import Call, Request
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import machine_memory, rendering_memory
from spin_usd.processes.cluster.worker_folder import Output, WorkerFolder
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.processors import share_of, usable_cpus
from spin_usd.processes.readable import readable
from spin_usd.store.publish.mirror import publish_picture

LOOK_S = 1.0  # between two checks of a worker's memory
REPORT_S = 2.0  # between two reports of a worker's processor usage
LARGEST_SHARE = 0.9  # of the machine's memory, for all workers together
MIN_MEMORY = 2 << 30  # bytes that a worker may always hold

Message = Mapping[str, Any]
"""Message of a worker, unchanged; {"died": {"found": ..., "cause": ...}} if it has ended, {"usage": {...}} for its
processor usage."""


@dataclass(frozen=True, kw_only=True)
class WorkerOpening:
    """The opening of an actor."""

    output: Output
    call: Call[Any, Any]
    """Call that opens the worker."""
    request: Mapping[str, Any]
    """Its request as JSON, without folders and processors."""
    versions: Mapping[str, str]
    """Versions of the supervisor's software."""
    number: int
    """Its place among the workers that share the machine."""
    of: int | None = None
    """How many share it; None where `number` counts processors."""


class WorkerActor:
    """The actor of a worker, and the worker. `receive` waits in one thread, while another calls the rest."""

    def __init__(self) -> None:
        self._held = ExitStack()
        self._folder: WorkerFolder | None = None
        self._child: Child | None = None

    def open(self, opening: WorkerOpening) -> list[Message]:
        """Start the worker; it gets the opening call. Returns an error if this machine is not fit for it."""
        try:
            node = socket.gethostname()
            refuse_other_software(opening.versions, node)
            self._folder = self._held.enter_context(opening.output.entered(node))
        except SpinError as error:
            return [as_message(error)]
        self._child = self._held.enter_context(Child(scratch=self._folder.work, memory=rendering_memory(), writes=None))
        folders = {"root": str(self._folder.root), "work": str(self._folder.work)}
        cpus = share_of(opening.number, opening.of or len(usable_cpus()))
        options = {**opening.request["options"], **folders}
        self._child.send(opening.call, {**opening.request, "options": options, "cpus": list(cpus)})
        return []

    def send(self, call: Call[Request, Any], request: Request) -> None:
        """Send the worker a call; the answer comes through `receive`."""
        assert self._child
        self._child.send(call, request)

    def receive(self) -> list[Message]:
        """Wait for the worker's next messages, and return them; its pictures are published by then. After REPORT_S at
        the latest, return its usage."""
        assert self._child
        try:
            report_at = time.monotonic() + REPORT_S
            while not readable(self._child, LOOK_S):
                self._refuse_growth(self._child)
                usage = self._child.usage()
                if time.monotonic() >= report_at:
                    return [{"usage": asdict(usage)}]
            return [self._published(message) for message in self._child.messages()]
        except ChildDiedError as died:
            return [{"died": {"found": died.found, "cause": died.cause}}]

    def close(self) -> None:
        """Let the idle worker end by itself, and leave its folder."""
        self._held.close()

    def kill(self) -> None:
        """End the worker at once, and leave its folder."""
        if self._child:
            self._child.kill()
        self._held.close()

    def _refuse_growth(self, child: Child) -> None:
        """End a worker that holds more memory than its share of this machine. Raises ChildDiedError."""
        limit = max(int(LARGEST_SHARE * machine_memory()) // len(usable_cpus()), MIN_MEMORY)
        if died := child.outgrown(limit):
            raise died

    def _published(self, message: Message) -> Message:
        """Publish the picture that the worker has made, if the dataset is elsewhere; return the message for it."""
        made = message.get("result")
        if self._folder and self._folder.url and isinstance(made, dict) and "record" in made:
            try:
                publish_picture(self._folder.root, made["record"], self._folder.url)
            except SpinError as error:
                return as_message(error)
        return message


def as_message(error: SpinError) -> Message:
    """Return the error as a worker would send it."""
    where = None if error.where is None else str(error.where)
    trace = "".join(traceback.format_exception(error))
    kind = type(error).__name__
    return {"error": {"kind": kind, "found": error.found, "where": where, "do": error.do, "traceback": trace}}


def refuse_other_software(expected: Mapping[str, str], node: str) -> None:
    """Raise InputError where `node`, this machine, does not have the supervisor's software: pictures would differ."""
    found = library_versions()
    for name in expected:
        if found[name] != expected[name]:
            versions = f"has {name} {found[name]}, and the machine that plans has {expected[name]}"
            raise InputError(versions, where=f"node {node}", do="install the same on all of them")
