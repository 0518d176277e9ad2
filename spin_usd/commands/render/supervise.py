"""Feed workers picture by picture, outlive their crashes and hangs, and bound their memory."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import count, islice
from typing import Any, Protocol

from spin_usd.commands.render.task_queue import RenderTask, TaskQueue
from spin_usd.errors import OutputError, RenderError
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.time_limit import TimeLimits
from spin_usd.processes.child_limits import PATIENCE_S, START_PATIENCE_S
from spin_usd.processes.deaths import ChildDiedError, DeathCause, Retries
from spin_usd.processes.pool import Answered, ChildProtocol, Failed, Pool, Reported
from spin_usd.stop_signals import StopRequest


class Listener(Protocol):
    """A listener that is called when a worker is ready for its first picture, when a picture ends, and when so many are
    the last."""

    def ready(self) -> None: ...

    def done(self, picture: PlannedPicture, result: Mapping[str, Any]) -> None: ...

    def failed(self, picture: PlannedPicture, reason: str) -> None: ...

    def stopping(self, pictures: int) -> None: ...


@dataclass(frozen=True, kw_only=True)
class WorkerLimits:
    """The limits of a worker. time: of its pictures · memory: bytes beyond which it is replaced after its picture ·
    most_memory: bytes beyond which it is replaced at once, and its picture tried again."""

    time: TimeLimits
    memory: int
    most_memory: int


@dataclass(kw_only=True, eq=False)
class WorkerSlot:
    """The place of a worker: whether that has started, what it is at, the variant that it has open, and the seconds
    that its picture may take, as Patience counts them, None as long as its stage is opened."""

    number: int
    started: bool = False
    task: RenderTask | None = None
    variant: str | None = None
    limit_s: float | None = None


def supervise(
    tasks: Iterable[RenderTask],
    *,
    free_slots: Callable[[], int],
    start: Callable[[int], ChildProtocol],
    listener: Listener,
    limits: WorkerLimits,
    stop: StopRequest,
) -> None:
    """Make all pictures with children; returns when each is done or has failed too often, or once `stop` is asked for
    and those at work are.

    `free_slots()` says how many workers there may be at the time. `start(number)` starts a child that was already sent
    its "open_worker". Raises OutputError when results cannot be written, RenderError when no worker starts.
    """
    queue = TaskQueue(tasks)
    with Pool[WorkerSlot](memory=limits.most_memory) as pool:
        supervisor = _Supervisor(queue, pool, start, listener, limits)
        while queue or len(pool):
            supervisor.start_workers(free_slots())
            for event in pool.wait():
                supervisor.handle_event(event)
            if stop.number is not None:
                supervisor.stop()
            for slot in pool.idle():
                supervisor.assign_next(slot)


class _Supervisor:
    """The supervisor of the workers: it decides what each does next."""

    def __init__(
        self,
        queue: TaskQueue,
        pool: Pool[WorkerSlot],
        start: Callable[[int], ChildProtocol],
        listener: Listener,
        limits: WorkerLimits,
    ) -> None:
        self._queue, self._pool, self._start = queue, pool, start
        self._listener, self._limits = listener, limits
        self._stopping = False
        self._while_starting = defaultdict[int, Retries](Retries)  # since the last picture that any worker made

    def start_workers(self, slots: int) -> None:
        """Start workers while there is work and room for them; end those that have not started when there is none."""
        starting = [slot for slot in self._pool if not slot.started]
        if not self._queue:
            for slot in starting:
                self._pool.kill(slot)
        taken = {slot.number for slot in self._pool}
        free = (number for number in count() if number not in taken)
        for number in islice(free, max(0, min(slots - len(taken), len(self._queue) - len(starting)))):
            self._pool.add(WorkerSlot(number=number), self._start(number), within_s=START_PATIENCE_S)

    def assign_next(self, slot: WorkerSlot) -> None:
        """Give an idle worker the next picture that it can make now, if there is one; end it when there are no more."""
        if not self._queue:
            self._pool.close(slot)
        elif task := self._queue.take():
            slot.task = task
            picture, kinds = task.picture, task.kinds
            asked = {
                "variant": picture.variant,
                "index": picture.index,
                "kinds": kinds,
                "keep_render": task.keep_render,
                "keep_labels": task.keep_labels,
            }
            slot.limit_s = self._time(task) if slot.variant == picture.variant else None
            self._pool.send(slot, "picture", within_s=slot.limit_s or PATIENCE_S, **asked)

    def _time(self, task: RenderTask) -> float:
        return self._limits.time.of(task.picture, task.kinds)

    def stop(self) -> None:
        """Begin no more pictures, and end the workers that have none."""
        if self._stopping:
            return
        self._stopping = True
        self._queue.clear()
        for slot in self._pool:
            if slot.task is None:
                self._pool.kill(slot)
        self._listener.stopping(len(self._pool))

    def handle_event(self, event: Reported[WorkerSlot] | Answered[WorkerSlot] | Failed[WorkerSlot]) -> None:
        """Take what came of the slot's worker or picture."""
        slot = event.key
        match event:
            case Reported() if slot.task:  # its stage is open
                slot.variant = slot.task.picture.variant
                slot.limit_s = self._time(slot.task)
                self._pool.give(slot, slot.limit_s)
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
            slot.started = True
            self._listener.ready()
            return
        self._while_starting.clear()
        self._queue.finish(task)
        self._listener.done(task.picture, result)
        if self._queue and result["memory"] > self._limits.memory:
            self._pool.kill(slot)

    def _died(self, slot: WorkerSlot, died: ChildDiedError) -> None:
        """Try the slot's picture again, unless it was tried often enough."""
        task, slot.task = slot.task, None
        if self._stopping:
            return
        if task is None:
            retries = self._while_starting[slot.number]
            if not retries.may_try_again(died):
                found = f"no worker can be started: {retries.in_words(died)}"
                raise RenderError(found, do="run spin-usd doctor") from died
        elif task.retries.may_try_again(died):
            self._queue.put_back(task)
        else:
            self._queue.give_up(task)
            self._listener.failed(task.picture, _why(slot, task, died))


def _why(slot: WorkerSlot, task: RenderTask, died: ChildDiedError) -> str:
    """Say why the task is given up, of a picture that ran away or hangs with what can be done."""
    why = task.retries.in_words(died)
    if died.cause is DeathCause.RAN_AWAY and slot.limit_s is not None:
        return f"{why}; --picture-timeout gives it more"
    if died.cause is DeathCause.HUNG:
        return f"{why}; look at the disk, network or driver that it waits for"
    return why
