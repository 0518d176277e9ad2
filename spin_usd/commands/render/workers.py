"""The worker processes of a run: their number, processors and memory.

They get one picture at a time; the run survives their crashes and hangs.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import psutil

from spin_usd.basics.stop_signals import StopRequest
from spin_usd.commands.render.calls import OPEN_WORKER, MadePicture, OpenWorker
from spin_usd.commands.render.destination import StartWorker
from spin_usd.commands.render.render_run import RenderRun
from spin_usd.commands.render.report import RunListener
from spin_usd.commands.render.task_queue import RenderTask, TaskQueue
from spin_usd.errors import OutputError
from spin_usd.options import MAX_WORKERS
from spin_usd.picture.planned_picture import PlannedPicture
from spin_usd.planning.time_limit import TimeLimits
from spin_usd.planning.worker_options import WorkerOptions
from spin_usd.processes.child import Child, in_process
from spin_usd.processes.child_limits import PATIENCE_S, machine_memory, rendering_memory
from spin_usd.processes.crew import Crew
from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.processes.pool import ChildProtocol
from spin_usd.processes.processors import share_of, usable_cpus
from spin_usd.processes.task import Done, Event, GivenUp, Opened, WorkerReport
from spin_usd.scene.effort import CPU

MEMORY_PER_WORKER = 1 << 30  # bytes a worker is expected to need at most; 300-400 MB is usual
HULL_MODULE = "scipy.spatial"  # for the hull of every target; it takes a third of a second to load
USUAL_SHARE, LARGEST_SHARE = 0.5, 0.9  # of the machine's memory, for all workers together


def default_workers() -> int:
    """Return the number of workers for the processors and the memory."""
    return max(1, min(len(usable_cpus()), psutil.virtual_memory().available // MEMORY_PER_WORKER))


def workers_and_cores(tasks: int, asked: int | None, *, cluster: bool) -> tuple[int, int]:
    """Return the largest number of workers for so many tasks, and the number of processors that they share: in a
    cluster each has its own. `asked`: the user's number of workers."""
    if cluster:
        count = min(asked or MAX_WORKERS, tasks)
        return count, count
    if in_process():  # Blender's state is the process's
        return 1, len(usable_cpus())
    return min(asked or default_workers(), tasks), len(usable_cpus())


class WorkerProcesses:
    """Starts the workers of a run.

    The first worker of this machine can be started before its task is known: a renderer loads for longer than the plan
    of a few pictures takes.
    """

    def __init__(self, run: RenderRun) -> None:
        self.destination, self._lease, request = run.destination, run.lease, run.request
        graphics = request.device != CPU
        renderer = (renderer_entry(request.renderer).module,) if request.renders else ()
        self._process = partial(
            Child,
            keep_open=(run.lease.descriptor,),
            scratch=run.lease.work,
            memory=rendering_memory(graphics=graphics),
            modules=(OPEN_WORKER.module, *renderer, HULL_MODULE),
            writes=None if graphics else (run.store.root,),
        )
        self._ahead: Child | None = None

    @contextmanager
    def one_ahead(self) -> Iterator[None]:
        """Start a process, which ends with the block unless it became a worker."""
        self._ahead = self._process()
        try:
            yield
        finally:
            if self._ahead:
                self._ahead.kill()

    def starter(self, options: WorkerOptions, workers: int) -> StartWorker:
        """Return the function that starts a worker by its number, of so many at most."""
        return self.destination.start(options, self._lease, workers) or partial(self._start, options, workers)

    def _start(self, options: WorkerOptions, workers: int, number: int) -> Child:
        child, self._ahead = self._ahead or self._process(), None
        with suppress(ChildDiedError):  # the end of its answers reports it too
            child.send(OPEN_WORKER, OpenWorker(options=options, cpus=share_of(number, workers)))
        return child


def make_pictures(
    options: WorkerOptions,
    tasks: list[RenderTask],
    workers: int,
    processes: WorkerProcesses,
    listener: RunListener,
    time_limits: TimeLimits,
    stop: StopRequest,
) -> None:
    """Make the pictures of the tasks in at most so many workers; once `stop` is requested, only the running ones.
    Raises as supervise does."""
    start_worker, cluster = processes.starter(options, workers), processes.destination.cluster

    def start(number: int) -> ChildProtocol:
        started = options.settings.renderer if options.renders else "label pass"
        listener.progress(f"starting {started}: worker", number + 1, free_slots())
        return start_worker(number)

    def free_slots() -> int:
        return min(workers, cluster.free_slots()) if cluster else workers

    usual, largest = (_share_of_memory(share, workers) for share in (USUAL_SHARE, LARGEST_SHARE))
    memory = MemoryLimits(
        usual=cluster.memory_per_worker() if cluster else usual, largest=max(largest, 2 * MEMORY_PER_WORKER)
    )
    queue = TaskQueue(tasks, lambda task: time_limits.of(task.picture, task.kinds))
    supervise(queue, free_slots=free_slots, start=start, listener=listener, memory=memory, stop=stop)


def _share_of_memory(share: float, workers: int) -> int:
    """Return the bytes for each of so many workers: their part of that share of the machine's memory, or the expected
    need of a worker."""
    return max(int(share * machine_memory()) // workers, MEMORY_PER_WORKER)


class Listener(Protocol):
    """A listener that is called when a worker is ready for its first picture, when a picture ends, and when only so
    many are left."""

    def ready(self) -> None: ...

    def done(self, picture: PlannedPicture, made: MadePicture) -> None: ...

    def failed(self, picture: PlannedPicture, reason: str) -> None: ...

    def stopping(self, pictures: int) -> None: ...


@dataclass(frozen=True, kw_only=True)
class MemoryLimits:
    """The memory of a worker."""

    usual: int
    """Bytes beyond which it is replaced after its picture."""
    largest: int
    """Bytes beyond which it is replaced at once, and its picture tried again."""


def supervise(
    queue: TaskQueue,
    *,
    free_slots: Callable[[], int],
    start: Callable[[int], ChildProtocol],
    listener: Listener,
    memory: MemoryLimits,
    stop: StopRequest,
) -> None:
    """Make all pictures with children; return when each is done or has failed too often, or, once `stop` is requested,
    when the running ones are.

    `free_slots()`: the current limit of the number of workers. `start(number)`: starts a child that was already sent
    OPEN_WORKER. Raises OutputError when results cannot be written, RenderError when no worker starts.
    """
    with Crew(start, queue, slots=free_slots, opening=OPEN_WORKER, memory=memory.largest) as crew:
        while crew.busy:
            for event in crew.step():
                _handle(event, crew, queue, listener, memory.usual)
            if stop.number is not None and not queue.closed:
                queue.close()
                crew.start_workers()  # ends those without a picture, before the user hears that a second signal acts
                listener.stopping(len(crew.tasks))


def _handle(
    event: Event[RenderTask], crew: Crew[RenderTask], queue: TaskQueue, listener: Listener, usual_memory: int
) -> None:
    match event:
        case Opened():
            listener.ready()
        case WorkerReport(worker=worker, task=task) if task:  # its stage is open
            limit_s = queue.opened(worker, task)
            if worker.task is task:  # it is still being made
                crew.give(worker, limit_s)
        case Done(worker=worker, task=task):
            queue.finish(task)
            listener.done(task.picture, task.result)
            if len(queue) and task.result.memory > usual_memory:
                crew.end(worker)
        case GivenUp(task=task, reason=reason):
            if task is None or isinstance(reason, OutputError):
                raise reason
            queue.give_up(task)
            listener.failed(task.picture, _why(task, reason))


def _why(task: RenderTask, reason: Exception) -> str:
    """Return why the task is given up, with the remedy for a picture that ran away or hangs."""
    cause = reason.cause if isinstance(reason, ChildDiedError) else None
    if cause is DeathCause.RAN_AWAY and task.within_s != PATIENCE_S:
        return f"{reason}; --picture-timeout allows more"
    if cause is DeathCause.HUNG:
        return f"{reason}; look at the disk, network or driver that it waits for"
    return str(reason)
