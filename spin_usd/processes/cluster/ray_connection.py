"""The connection to a worker's actor that Ray runs on some node of a cluster."""

import os
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from contextlib import suppress
from typing import Any

from spin_usd.errors import InputError
from spin_usd.processes.cluster.worker_actor import Message, WorkerActor, WorkerOpening
from spin_usd.processes.deaths import ChildDiedError, DeathCause

LOOK_S = 1.0
LEAVING_S = 10.0  # for a worker to end, and its node's folder to be removed


class NodeActor(WorkerActor):
    """An actor of Ray's. It ends with its node's Ray: what is lost to the cluster must not go on writing."""

    def __init__(self) -> None:
        super().__init__()
        threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()

    def node(self) -> str:
        """Return Ray's name of the node."""
        import ray

        return str(ray.get_runtime_context().get_node_id())


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)  # the kernel ends the worker with it


class RayConnection:
    """The connection to an actor on a node that Ray chooses, opened with what `opening` says of that node.

    post: a thread that takes in what comes from Ray, whose own threads must not wait · lives: whether a node is still
    in the cluster.
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

    def send(self, call: str, arguments: Mapping[str, Any]) -> None:
        self._ask("send", call, arguments)

    def receive(self) -> "Future[list[Message]]":
        return self._ask("receive")

    def close(self) -> None:
        self._leave("close")

    def kill(self) -> None:
        if self.node is None:  # it may never have one
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
        """Ask the actor for that method's result, which comes in the thread `post`."""
        answer: Future[Any] = Future()

        def take(given: "Future[Any]") -> None:
            if error := given.exception():
                answer.set_exception(self._in_our_words(error))
            else:
                answer.set_result(given.result())

        def post(given: "Future[Any]") -> None:
            with suppress(RuntimeError):  # the run is over, and nobody waits for it
                self._post.submit(take, given)

        getattr(self._actor, method).remote(*arguments).future().add_done_callback(post)
        return answer

    def _in_our_words(self, error: BaseException) -> BaseException:
        """Return the error that a pool knows in place of one of Ray's."""
        from ray.exceptions import RayActorError

        if not isinstance(error, RayActorError):
            return error
        last = str(error).strip().splitlines()[-1]
        if error.actor_init_failed:
            return InputError(f"a node cannot start a worker ({last})", do="install the same spin_usd on every node")
        if self.node and self._lives(self.node):
            return ChildDiedError(f"what stands by the worker on its node ended ({last})", cause=DeathCause.KILLED)
        return ChildDiedError("the node of the worker has gone", cause=DeathCause.LOST)


def _pass_on(done: "Future[Any]", to: "Future[Any]") -> None:
    if error := done.exception():
        to.set_exception(error)
    else:
        to.set_result(done.result())
