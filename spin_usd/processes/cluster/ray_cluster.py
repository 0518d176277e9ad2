"""A Ray cluster, on which a run has as many workers as there are processors for at the time."""

import logging
import os
import signal
import socket
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import Any, Self

from spin_usd.errors import InputError, RenderError
from spin_usd.processes.cluster.ray_connection import NodeActor, RayConnection
from spin_usd.processes.cluster.remote_child import RemoteChild
from spin_usd.processes.cluster.worker_actor import WorkerOpening

LOOK_S = 2.0  # between two looks at which nodes there are
KNOCK_S = 10.0  # for the cluster's head to answer
CLOSING_S = 10.0  # for workers to leave their nodes at the end
MEMORY_PER_WORKER = 1 << 30  # bytes of its node that Ray keeps for each worker
START = "start one with `ray start --head`, or give its address"
INSTALL = "run pip install '.[cluster]' where spin_usd's source is"


class RayCluster:
    """The cluster at `address`: "auto", HOST:PORT, or ray://HOST:PORT. Workers are ended, and the cluster is left, when
    its block ends."""

    def __init__(self, address: str) -> None:
        """Raises InputError where Ray is not installed, or no cluster answers."""
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
        """Return for how many workers of this run there are processors and memory now; 1 at least, for a cluster may
        grow only when it is asked for more. Raises RenderError where the cluster has gone."""
        if time.monotonic() - self._looked > LOOK_S:
            self._looked = time.monotonic()
            self._connections = [
                connection for connection in self._connections if not connection.ended or connection.closed
            ]
            self._free_slots = max(1, self._counted())
        return self._free_slots

    def memory_per_worker(self) -> int:
        """Return how many bytes a worker has on the node that has the least for each."""
        import ray

        alive = (node["Resources"] for node in ray.nodes() if node["Alive"])
        shares = (int(has["memory"]) // workers for has in alive if (workers := _fitting(has)))
        return min(shares, default=MEMORY_PER_WORKER)

    def start(self, opening: Callable[[int], WorkerOpening]) -> RemoteChild:
        """Start a worker where Ray has room for it; `opening` says with what, of its number on that node."""
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
        """Take the lowest number on that node which no living worker of this run has."""
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
    try:
        import ray
    except ImportError:
        raise InputError("needs Ray, which is not installed", where="--cluster", do=INSTALL) from None
    if ray.is_initialized():
        return False
    ray._private.worker._worker_logs_enabled = False  # it prints of nodes that died, on standard output
    try:
        _knock(address if address != "auto" else str(ray._private.services.canonicalize_bootstrap_address(address)))
        with _own_signals():
            ray.init(address=address, log_to_driver=False, logging_level=logging.CRITICAL)
    except Exception as error:  # of many kinds: no cluster, another version of Ray or Python, a malformed address
        found = f"no cluster of Ray's answers ({type(error).__name__}: {error})"
        raise InputError(found, where=f"--cluster {address}", do=START) from error
    return True


def _knock(address: str) -> None:
    """Raise OSError where nobody listens at HOST:PORT, of which Ray itself makes sure for two minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if port.isdecimal():
        socket.create_connection((host.strip("[]"), int(port)), timeout=KNOCK_S).close()


@contextmanager
def _own_signals() -> Iterator[None]:
    """Keep this program's own handlers of signals, some of which Ray replaces."""
    main = threading.current_thread() is threading.main_thread()
    before: dict[int, Any] = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in before.items() if main else ():
            signal.signal(number, handler)
