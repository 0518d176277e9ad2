"""A Ray cluster, on which the number of a run's workers follows the number of free processors.

A connection leads to a worker's actor, which Ray runs on some node.
"""

import logging
import os
import signal
import socket
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from typing import Any, Self

from spin_usd.basics.extras import EXTRAS
from spin_usd.errors import InputError, RenderError
from spin_usd.processes.call import Call, Request
from spin_usd.processes.cluster.remote_child import RemoteChild
from spin_usd.processes.cluster.worker_actor import Message, WorkerActor, WorkerOpening
from spin_usd.processes.deaths import ChildDiedError, DeathCause

LOOK_S = 2.0  # between two listings of the nodes
KNOCK_S = 10.0  # for the cluster's head to answer
CLOSING_S = 10.0  # for workers to leave their nodes at the end
MEMORY_PER_WORKER = 1 << 30  # bytes of its node that Ray keeps for each worker
START = "start one with `ray start --head`, or give its address"
PARENT_LOOK_S = 1.0  # between two looks at whether its node's Ray still runs
LEAVING_S = 10.0  # for a worker to end, and its node's folder to be removed


class NodeActor(WorkerActor):
    """An actor of Ray's. It ends with its node's Ray: a worker lost to the cluster must not go on writing."""

    def __init__(self) -> None:
        super().__init__()
        threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()

    def node(self) -> str:
        """Return Ray's name of the node."""
        import ray

        return str(ray.get_runtime_context().get_node_id())


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PARENT_LOOK_S)
    os._exit(1)  # the kernel ends the worker with it


class RayConnection:
    """The connection to an actor on a node that Ray chooses, opened with the result of `opening` for that node.

    Args:
        post: A thread that handles results from Ray, whose own threads must not wait.
        lives: Whether a node is still in the cluster.
    """

    def __init__(
        self, actor: Any, opening: Callable[[str], WorkerOpening], *, post: Executor, lives: Callable[[str], bool]
    ) -> None:
        self._actor, self._opening, self._post, self._lives = actor, opening, post, lives
        self.node: str | None = None
        self.ended = False
        self.closed: Future[Any] | None = None

    def open(self) -> "Future[list[Message]]":
        opened: Future[list[Message]] = Future()

        def open_there(placed: "Future[str]") -> None:
            try:
                self.node = placed.result()
                self._ask("open", self._opening(self.node)).add_done_callback(lambda done: _pass_on(done, opened))
            except BaseException as error:
                opened.set_exception(error)

        self._ask("node").add_done_callback(open_there)
        return opened

    def send(self, call: Call[Request, Any], request: Request) -> None:
        self._ask("send", call, request)

    def receive(self) -> "Future[list[Message]]":
        return self._ask("receive")

    def close(self) -> None:
        self._leave("close")

    def kill(self) -> None:
        if self.node is None:  # it may never get one
            self._end()
        else:
            self._leave("kill")

    def _leave(self, how: str) -> None:
        """Let the actor leave its folder first, for which it has LEAVING_S."""
        self.ended = True
        late = threading.Timer(LEAVING_S, self._end)
        late.daemon = True
        late.start()

        def left(_: object) -> None:
            late.cancel()
            self._end()

        self.closed = self._ask(how)
        self.closed.add_done_callback(left)

    def _end(self) -> None:
        import ray

        self.ended = True
        with suppress(Exception):  # it has gone, or the cluster has
            if ray.is_initialized():  # else Ray would connect again, just to end it
                ray.kill(self._actor)

    def _ask(self, method: str, *arguments: Any) -> "Future[Any]":
        """Call that method of the actor; its result comes in the thread `post`."""
        answer: Future[Any] = Future()

        def take(given: "Future[Any]") -> None:
            if error := given.exception():
                answer.set_exception(self._in_our_words(error))
            else:
                answer.set_result(given.result())

        def post(given: "Future[Any]") -> None:
            with suppress(RuntimeError):  # the run is over
                self._post.submit(take, given)

        getattr(self._actor, method).remote(*arguments).future().add_done_callback(post)
        return answer

    def _in_our_words(self, error: BaseException) -> BaseException:
        """Convert an error of Ray's to one that a pool handles."""
        from ray.exceptions import RayActorError

        if not isinstance(error, RayActorError):
            return error
        last = str(error).strip().splitlines()[-1]
        if error.actor_init_failed:
            return InputError(f"a node cannot start a worker ({last})", do="install the same spin_usd on every node")
        if self.node and self._lives(self.node):
            return ChildDiedError(f"the actor of the worker ended on its node ({last})", cause=DeathCause.KILLED)
        return ChildDiedError("the node of the worker has gone", cause=DeathCause.LOST)


def _pass_on(done: "Future[Any]", to: "Future[Any]") -> None:
    if error := done.exception():
        to.set_exception(error)
    else:
        to.set_result(done.result())


class RayCluster:
    """The cluster at `address`: "auto", HOST:PORT, or ray://HOST:PORT. Workers are ended, and the cluster is left, when
    its block ends."""

    def __init__(self, address: str) -> None:
        """Raises MissingPackageError without Ray, InputError where no cluster answers."""
        self._connected = _connect(address)
        self._post = ThreadPoolExecutor(max_workers=1)
        self._connections: list[RayConnection] = []
        self._numbers: defaultdict[str, dict[int, RayConnection]] = defaultdict(dict)
        self._looked, self._free_slots = float("-inf"), 1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        import ray

        wait([connection.closed for connection in self._connections if connection.closed], timeout=CLOSING_S)
        self._post.shutdown(wait=False, cancel_futures=True)
        if self._connected:
            ray.shutdown()

    def free_slots(self) -> int:
        """Return the number of workers of this run that now have processors and memory; 1 at least, for a cluster may
        grow only on demand. Raises RenderError if the cluster has gone."""
        if time.monotonic() - self._looked > LOOK_S:
            self._looked = time.monotonic()
            self._connections = [
                connection for connection in self._connections if not connection.ended or connection.closed
            ]
            self._free_slots = max(1, self._counted())
        return self._free_slots

    def memory_per_worker(self) -> int:
        """Return the bytes for each worker on the node with the least."""
        import ray

        alive = (node["Resources"] for node in ray.nodes() if node["Alive"])
        shares = (int(has["memory"]) // workers for has in alive if (workers := _fitting(has)))
        return min(shares, default=MEMORY_PER_WORKER)

    def start(self, opening: Callable[[int], WorkerOpening]) -> RemoteChild:
        """Start a worker where Ray has room for it; `opening` returns its opening for its number on that node."""
        import ray

        actor = ray.remote(NodeActor).options(
            num_cpus=1, memory=MEMORY_PER_WORKER, max_concurrency=4, scheduling_strategy="SPREAD"
        )
        connection = RayConnection(
            actor.remote(), lambda node: opening(self._number(node, connection)), post=self._post, lives=_lives
        )
        self._connections.append(connection)
        return RemoteChild(connection)

    def _counted(self) -> int:
        import ray

        try:
            here = sum(_fitting(node["Resources"]) for node in ray.nodes() if node["Alive"])
            free = _fitting(ray.available_resources())
        except Exception as error:
            raise RenderError(f"the cluster does not answer ({error})", do="run again, and it resumes") from error
        own = sum(1 for connection in self._connections if connection.node and not connection.ended)
        return min(here, own + free)

    def _number(self, node: str, connection: RayConnection) -> int:
        """Take the lowest number on that node that no living worker of this run has."""
        taken = self._numbers[node]
        number = next(number for number in range(len(taken) + 1) if number not in taken or taken[number].ended)
        taken[number] = connection
        return number


def _fitting(resources: dict[str, float]) -> int:
    """Return how many workers these resources are enough for."""
    return int(min(resources.get("CPU", 0.0), resources.get("memory", 0.0) // MEMORY_PER_WORKER))


def _lives(node: str) -> bool:
    import ray

    return any(other["NodeID"] == node and other["Alive"] for other in ray.nodes())


def _connect(address: str) -> bool:
    """Connect to the cluster, and return whether this program was not connected to one already."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # Ray reports its use to its makers otherwise
    EXTRAS["cluster"].require(but="fsspec")  # which URLs alone need
    import ray

    if ray.is_initialized():
        return False
    ray._private.worker._worker_logs_enabled = False  # it prints messages on dead nodes to standard output
    try:
        _knock(address if address != "auto" else str(ray._private.services.canonicalize_bootstrap_address(address)))
        with _own_signals():
            ray.init(address=address, log_to_driver=False, logging_level=logging.CRITICAL)
    except Exception as error:  # of many kinds: no cluster, another version of Ray or Python, a malformed address
        found = f"no Ray cluster answers ({type(error).__name__}: {error})"
        raise InputError(found, where=f"--cluster {address}", do=START) from error
    return True


def _knock(address: str) -> None:
    """Raise OSError if no process listens at HOST:PORT; Ray itself tries for two minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if port.isdecimal():
        socket.create_connection((host.strip("[]"), int(port)), timeout=KNOCK_S).close()


@contextmanager
def _own_signals() -> Iterator[None]:
    """Keep this program's own handlers of signals: Ray replaces some."""
    main = threading.current_thread() is threading.main_thread()
    before: dict[int, Any] = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in before.items() if main else ():
            signal.signal(number, handler)
