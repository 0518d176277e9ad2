"""`spin-usd serve`: pictures of a stage for programs in any language, by ZeroMQ and msgpack.

A client gets one reply to each request: pictures in the order of its requests, other answers at once. Clients whose
requests wait take turns.
"""

import os
import re
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import zmq
from msgspec import UNSET, MsgspecError, Struct
from msgspec.msgpack import Decoder, Encoder

import spin_usd
from spin_usd.basics.stop_signals import Stopped, postponed
from spin_usd.basics.suggestion import suggestion
from spin_usd.commands.serve.messages import (
    MAX_MESSAGE,
    Asked,
    SentArray,
    SentError,
    SentPicture,
    SentPong,
    SentStage,
)
from spin_usd.commands.serve.options import PORT, ServeOptions
from spin_usd.errors import InputError, SpinError
from spin_usd.options import names_in
from spin_usd.picture.kinds import FILE_KINDS
from spin_usd.processes.child import ChildInternalError
from spin_usd.processes.patience import LOOK_S
from spin_usd.scene.environment import BACKGROUND
from spin_usd.simulator.picture_workers import SimulatorTask
from spin_usd.simulator.shared_arrays import numpy_type
from spin_usd.simulator.simulator import Simulator
from spin_usd.studio.picture_request import PictureRequest

KEYS = "a map with the keys of docs/how-to/simulator.md"
ASKED = tuple(each for each in Asked.__struct_fields__ if each not in ("ask", "arrays", "record"))
"""Fields of a message that `Simulator.request` takes."""
MAX_WAITING = 16  # requests of one client that may wait: more are refused
AHEAD = 2  # pictures that the worker has: it need not wait for us
ADDRESS = re.compile(r"tcp://(?:\[[^\]]+\]|[^\[\]:/\s]+):(?:(\d{1,5})|\*)|ipc://.+")
MAX_PORT = 65535
HERE = f"tcp://127.0.0.1:{PORT}"
ON_THIS_MACHINE = ("tcp://127.", "tcp://localhost:", "tcp://[::1]:", "ipc://")


def serve(options: ServeOptions, *, tell: Callable[[str], None]) -> None:
    """Serve pictures until a signal stops it; `tell` takes lines for the user. Raises InputError if it cannot listen,
    and the errors of opening the stage."""
    at = HERE if options.at is None else options.at
    with suppress(Stopped), _listening(at) as socket, _simulator(options) as simulator:
        where = socket.getsockopt_string(zmq.LAST_ENDPOINT)
        if not at.startswith(ON_THIS_MACHINE):
            tell(f"note: {where} can be reached from other machines; there is no authentication")
        tell(f"{where}   ({len(simulator)} frames; Ctrl-C ends)")
        Server(socket, simulator).run()


@contextmanager
def _listening(at: str) -> Iterator["zmq.Socket[bytes]"]:
    with zmq.Context() as context, context.socket(zmq.ROUTER) as socket:
        socket.setsockopt(zmq.MAXMSGSIZE, MAX_MESSAGE)
        socket.setsockopt(zmq.LINGER, 1000)
        if at.startswith("ipc://") and os.path.exists(at.removeprefix("ipc://")):
            do = "end the server that uses it, or remove it"
            raise InputError("exists already", where=at.removeprefix("ipc://"), do=do)
        port = ADDRESS.fullmatch(at)
        if port is None or int(port[1] or 0) > MAX_PORT:
            raise InputError(f"{at} is not an address", do="give one such as tcp://127.0.0.1:8644, or ipc://FILE")
        try:
            socket.bind(at)
        except zmq.ZMQError as error:
            do = "choose another port, or free it; addresses are like tcp://127.0.0.1:8644 or ipc://PATH"
            raise InputError(f"{at} is not available ({error.strerror})", do=do) from None
        if at.startswith("ipc://"):
            os.chmod(at.removeprefix("ipc://"), 0o600)
        try:
            yield socket
        finally:
            if at.startswith("ipc://"):  # ZeroMQ leaves it
                Path(at.removeprefix("ipc://")).unlink(missing_ok=True)


def _simulator(options: ServeOptions) -> Simulator:
    return Simulator(
        options.stage,
        variant=options.variant,
        renderer=options.renderer,
        quality=options.quality,
        samples=options.samples,
        effort=options.effort,
        seed=options.seed,
        log=options.log if options.log is None else Path(options.log),
        log_parts=names_in(options.parts),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Wanted:
    """A picture that a client waits for."""

    client: bytes
    envelope: list[bytes]
    request: PictureRequest
    arrays: tuple[str, ...]
    record: bool


class Server:
    """Answers the messages that come to the socket with pictures by the simulator."""

    def __init__(self, socket: "zmq.Socket[bytes]", simulator: Simulator) -> None:
        self._socket, self._simulator, self._workers = socket, simulator, simulator.workers
        self._waiting: dict[bytes, deque[_Wanted]] = {}  # by client, in the order of their turns
        self._made: dict[SimulatorTask, _Wanted] = {}
        self._decoder, self._encoder = Decoder(Asked), Encoder()

    def run(self) -> None:
        """Answer messages until a signal, which it raises once it has refused the requests that wait."""
        poller = zmq.Poller()
        poller.register(self._socket, zmq.POLLIN)
        poller.register(self._workers.fileno(), zmq.POLLIN)
        with postponed() as stop:  # an interrupt between two lines would lose a request
            while stop.number is None:
                poller.poll(int(1000 * LOOK_S))
                self._receive()
                while self._work():
                    pass
            for wanted in [*self._made.values(), *(each for queue in self._waiting.values() for each in queue)]:
                self._send(wanted.client, wanted.envelope, SentError(error="the server was stopped"))

    def _work(self) -> bool:
        """Let the clients take turns until the worker has enough, and send what it made; return whether there was
        any."""
        while self._waiting and len(self._made) < AHEAD:
            client, queue = next(iter(self._waiting.items()))
            wanted = queue.popleft()
            del self._waiting[client]
            if queue:
                self._waiting[client] = queue  # at the end
            self._made[self._workers.ask(wanted.request, wanted.arrays, recorded=wanted.record)] = wanted
        self._workers.step(within_s=0)
        ended = [task for task in self._made if task.ended]
        for task in ended:
            self._reply(task, self._made.pop(task))
        return bool(ended)

    def _receive(self) -> None:
        """Receive messages."""
        with suppress(zmq.Again):
            while True:
                client, *envelope, body = self._socket.recv_multipart(zmq.NOBLOCK)
                answer = self.answer(client, envelope, body)
                if answer is not None:
                    self._send(client, envelope, answer)

    def answer(self, client: bytes, envelope: list[bytes], body: bytes) -> Struct | None:
        """Return the answer to any message; None if it has to wait for a picture."""
        try:
            return self._heard(client, envelope, body)
        except SpinError as error:
            return SentError(error=str(error))
        except Exception as defect:  # one message must not end the server for all others
            traceback.print_exception(defect)
            return SentError(error=f"the server has a defect: {defect!r}")

    def _heard(self, client: bytes, envelope: list[bytes], body: bytes) -> Struct | None:
        """Return the answer to a message; None if it has to wait for a picture. Raises InputError."""
        try:
            asked = self._decoder.decode(body)
        except (MsgspecError, UnicodeDecodeError, RecursionError) as error:
            raise InputError(f"the message cannot be read: {error}", do=f"send {KEYS} as msgpack") from None
        if asked.ask == "ping":
            return SentPong(waiting=len(self._made) + sum(map(len, self._waiting.values())))
        if asked.ask == "stage":
            return self._stage()
        if asked.ask != "picture":
            raise InputError(f"ask is {asked.ask!r}", do="make it picture, stage or ping")
        made = sum(wanted.client == client for wanted in self._made.values())
        if made + len(self._waiting.get(client, ())) >= MAX_WAITING:
            raise InputError(f"{MAX_WAITING} of your pictures wait already", do="take their replies first")
        request = self._request(asked)
        wanted = _Wanted(client=client, envelope=envelope, request=request, arrays=asked.arrays, record=asked.record)
        self._waiting.setdefault(client, deque()).append(wanted)
        return None

    def _request(self, asked: Asked) -> PictureRequest:
        """Return the request for a picture. Raises InputError."""
        if unknown := [kind for kind in asked.arrays if kind not in FILE_KINDS]:
            raise InputError(f"there is no {unknown[0]!r}", do=suggestion(unknown[0], FILE_KINDS))
        if BACKGROUND in (asked.values or {}):
            do = "draw photographs on the server's machine, by Simulator.stream"
            raise InputError(f"{BACKGROUND} names a file of the server's machine", do=do)
        return self._simulator.request(**{name: getattr(asked, name) for name in ASKED})

    def _reply(self, task: SimulatorTask, wanted: _Wanted) -> None:
        try:
            answer: Struct = _sent(task)
        except (SpinError, ChildInternalError) as error:
            answer = SentError(error=str(error))
        self._send(wanted.client, wanted.envelope, answer)

    def _stage(self) -> SentStage:
        simulator = self._simulator
        keypoints = {
            target.name: dict(zip(target.keypoints.names, target.keypoints.points.tolist(), strict=True))
            for target in simulator.description.targets
        }
        return SentStage(
            frames=list(simulator.frames),
            variants=list(simulator.variants),
            seed=simulator.seed,
            targets=keypoints,
            version=spin_usd.__version__,
        )

    def _send(self, client: bytes, envelope: list[bytes], answer: Struct) -> None:
        with suppress(zmq.Again):  # the client takes no replies
            self._socket.send_multipart([client, *envelope, self._encoder.encode(answer)], zmq.NOBLOCK)


def _sent(task: SimulatorTask) -> SentPicture:
    made = task.result
    return SentPicture(
        frame=made.frame,
        variant=made.variant,
        index=made.index,
        camera=made.camera,
        pose=made.pose,
        arrays={
            kind: SentArray(dtype=numpy_type(array.dtype), shape=list(array.shape), data=array.tobytes())
            for kind, array in task.arrays.items()
        },
        logged=UNSET if task.logged is None else task.logged,
        record=made.record or UNSET,
    )
