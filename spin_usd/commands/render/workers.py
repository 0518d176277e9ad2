"""The worker processes of a run: how many, on which processors, with how much memory.

They are fed picture by picture; what goes on outlives their crashes and hangs.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import count, islice
from typing import Any, Protocol

import psutil
from msgspec import convert, to_builtins

from spin_usd.basics.stop_signals import StopRequest
from spin_usd.commands.render.destination import Destination, StartWorker
from spin_usd.commands.render.report import RunListener
from spin_usd.commands.render.task_queue import RenderTask, TaskQueue
from spin_usd.errors import OutputError, RenderError
from spin_usd.options import MAX_WORKERS
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.time_limit import TimeLimits
from spin_usd.planning.worker_options import MadePicture, WorkerOptions
from spin_usd.processes.child import Child, in_process
from spin_usd.processes.child_limits import PATIENCE_S, START_PATIENCE_S, machine_memory, rendering_memory
from spin_usd.processes.deaths import ChildDiedError, DeathCause, Retries
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.processes.pool import Answered, ChildProtocol, Failed, Pool, Reported
from spin_usd.processes.processors import share_of, usable_cpus
from spin_usd.scene.effort import CPU
from spin_usd.store.dataset_folder import Lease

MEMORY_PER_WORKER = 1 << 30  # bytes a worker is expected to need at most; 300-400 MB is usual
WORKER_MODULE = "spin_usd.commands.render.worker"  # named as text: it loads USD
HULL_MODULE = "scipy.spatial"  # for the hull of every target; it takes a third of a second to load
USUAL_SHARE, LARGEST_SHARE = 0.5, 0.9  # of the machine's memory, for all workers together


def default_workers() -> int:
    """Return as many as there are processors and memory for."""
    return max(1, min(len(usable_cpus()), psutil.virtual_memory().available // MEMORY_PER_WORKER))


def workers_and_cores(tasks: int, asked: int | None, *, cluster: bool) -> tuple[int, int]:
    """Return how many workers there are at most for so many tasks, and how many processors these share: in a cluster
    each has its own. `asked`: how many workers the user wants."""
    if cluster:
        count = min(asked or MAX_WORKERS, tasks)
        return count, count
    if in_process():  # Blender's state is the process's
        return 1, len(usable_cpus())
    return min(asked or default_workers(), tasks), len(usable_cpus())


class WorkerProcesses:
    """Starts the workers of a run into the `destination` under its `lease`.

    The first of this machine can be started ahead, before anybody knows what it is to do: a renderer loads for longer
    than a few pictures are planned.
    """

    def __init__(self, destination: Destination, lease: Lease, request: RenderRequest) -> None:
        self.destination, self.lease = destination, lease
        self._memory = rendering_memory(graphics=request.device != CPU)
        renderer = (renderer_entry(request.renderer).module,) if request.renders else ()
        self._modules = (WORKER_MODULE, *renderer, HULL_MODULE)
        self._ahead: Child | None = None

    @contextmanager
    def one_ahead(self) -> Iterator[None]:
        """Start a process, which is ended with the block unless it became a worker."""
        self._ahead = self._process()
        try:
            yield
        finally:
            if self._ahead:
                self._ahead.kill()

    def starter(self, options: WorkerOptions, workers: int) -> StartWorker:
        """Return what starts a worker by its number, of so many at most."""
        return self.destination.start(options, self.lease, workers) or partial(self._start, options, workers)

    def _start(self, options: WorkerOptions, workers: int, number: int) -> Child:
        child, self._ahead = self._ahead or self._process(), None
        with suppress(ChildDiedError):  # the end of its answers says so too
            child.send("open_worker", options=to_builtins(options), cpus=share_of(number, workers))
        return child

    def _process(self) -> Child:
        lease = self.lease
        return Child(keep_open=(lease.descriptor,), scratch=lease.work, memory=self._memory, modules=self._modules)


def make_pictures(
    options: WorkerOptions,
    tasks: list[RenderTask],
    workers: int,
    processes: WorkerProcesses,
    listener: RunListener,
    time_limits: TimeLimits,
    stop: StopRequest,
) -> None:
    """Make the pictures of the tasks in so many worker processes at most; those that are running where `stop` is asked.
    Raises as supervise does."""
    start_worker, cluster = processes.starter(options, workers), processes.destination.cluster

    def start(number: int) -> ChildProtocol:
        started = options.settings.renderer if options.renders else "label pass"
        listener.progress(f"starting {started}: worker", number + 1, free_slots())
        return start_worker(number)

    def free_slots() -> int:
        return min(workers, cluster.free_slots()) if cluster else workers

    usual, largest = (_share_of_memory(share, workers) for share in (USUAL_SHARE, LARGEST_SHARE))
    limits = WorkerLimits(
        time=time_limits,
        memory=cluster.memory_per_worker() if cluster else usual,
        most_memory=max(largest, 2 * MEMORY_PER_WORKER),
    )
    supervise(tasks, free_slots=free_slots, start=start, listener=listener, limits=limits, stop=stop)


def _share_of_memory(share: float, workers: int) -> int:
    """Return bytes for each of so many workers, which together take that share of the machine's memory, or what a
    worker is expected to need."""
    return max(int(share * machine_memory()) // workers, MEMORY_PER_WORKER)


class Listener(Protocol):
    """A listener that is called when a worker is ready for its first picture, when a picture ends, and when so many are
    the last."""

    def ready(self) -> None: ...

    def done(self, picture: PlannedPicture, made: MadePicture) -> None: ...

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
        made = convert(result, MadePicture)
        self._listener.done(task.picture, made)
        if self._queue and made.memory > self._limits.memory:
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
