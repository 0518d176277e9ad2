"""Feed workers picture by picture, outlive their crashes, and bound their memory."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from spin_usd.dataset.picture.planned_picture import PlannedPicture
from spin_usd.dataset.process.child import Child, ChildDiedError
from spin_usd.dataset.process.limits import HANG_S
from spin_usd.dataset.process.pool import Answered, Failed, Pool, Reported
from spin_usd.dataset.render.task_queue import RenderTask, TaskQueue
from spin_usd.errors import OutputError, RenderError

TRIES = 2  # a picture whose worker died is tried once more: the next worker may have more luck
STARTS_PER_SLOT = 3  # a worker that dies this often in a row before its first picture is not a picture's fault


class Listener(Protocol):
    """A listener that is called when a worker is ready for its first picture, and when a picture ends."""

    def ready(self) -> None: ...

    def done(self, picture: PlannedPicture, result: Mapping[str, Any]) -> None: ...

    def failed(self, picture: PlannedPicture, reason: str) -> None: ...


@dataclass(kw_only=True, eq=False)
class WorkerSlot:
    """The place of one worker after another: what it is at, and how many were started since the last picture."""

    number: int
    task: RenderTask | None = None
    starts: int = 0


def supervise(
    tasks: Iterable[RenderTask],
    *,
    workers: int,
    start: Callable[[int], Child],
    listener: Listener,
    memory_limit: int,
    hang_s: float = HANG_S,
) -> None:
    """Make all pictures with `workers` children; returns when each is done or has failed twice.

    `start(number)` starts a child that was already sent its "open_worker". `memory_limit` in bytes: a worker above it
    is replaced after its picture. Raises OutputError when results cannot be written, RenderError when no worker starts.
    """
    queue = TaskQueue(tasks)
    with Pool[WorkerSlot](hang_s=hang_s) as pool:
        supervisor = _Supervisor(queue, pool, start, listener, memory_limit)
        for number in range(min(workers, len(queue))):
            supervisor.open(WorkerSlot(number=number))
        while len(pool):
            for event in pool.wait():
                supervisor.advance(event)
            for slot in pool.idle():
                supervisor.occupy(slot)


class _Supervisor:
    """The supervisor of the workers: it decides what each does next."""

    def __init__(
        self,
        queue: TaskQueue,
        pool: Pool[WorkerSlot],
        start: Callable[[int], Child],
        listener: Listener,
        memory_limit: int,
    ) -> None:
        self._queue, self._pool, self._start = queue, pool, start
        self._listener, self._memory_limit = listener, memory_limit

    def open(self, slot: WorkerSlot) -> None:
        """Start a worker in the slot."""
        slot.starts += 1
        self._pool.add(slot, self._start(slot.number), at_work=True)

    def occupy(self, slot: WorkerSlot) -> None:
        """Give an idle worker the next picture that it can make now, if there is one; end it when there are no more."""
        if not self._queue:
            self._pool.close(slot)
        elif task := self._queue.take():
            slot.task = task
            picture, kinds = task.picture, task.kinds
            place = {"variant": picture.variant, "index": picture.index}
            self._pool.send(slot, "picture", **place, kinds=kinds, keep_render=task.keep_render)

    def advance(self, event: Reported[WorkerSlot] | Answered[WorkerSlot] | Failed[WorkerSlot]) -> None:
        """Take what came of the slot's worker or picture."""
        slot = event.key
        match event:
            case Answered(result=result):
                self._answered(slot, result)
            case Failed(reason=ChildDiedError() as died):
                self._died(slot, died)
            case Failed(reason=reason):
                task, slot.task = slot.task, None
                if task is None or isinstance(reason, OutputError):
                    raise reason
                self._queue.give_up(task)
                self._listener.failed(task.picture, str(reason))

    def _answered(self, slot: WorkerSlot, result: Any) -> None:
        task, slot.task = slot.task, None
        if task is None:
            self._listener.ready()
            return
        slot.starts = 0
        self._queue.finish(task)
        self._listener.done(task.picture, result)
        if self._queue and result["memory"] > self._memory_limit:
            self._pool.kill(slot)
            self.open(slot)

    def _died(self, slot: WorkerSlot, died: ChildDiedError) -> None:
        """Try the slot's picture again, unless it was tried often enough, and replace the worker if there is work."""
        task, slot.task = slot.task, None
        if task is None:
            if slot.starts >= STARTS_PER_SLOT:
                raise RenderError(f"no worker can be started: {died.found}", do="run spin-usd doctor") from died
        elif task.tries + 1 >= TRIES:
            self._queue.give_up(task)
            self._listener.failed(task.picture, f"{died.found}, {TRIES} times")
        else:
            task.tries += 1
            self._queue.put_back(task)
        if self._queue:
            self.open(slot)
