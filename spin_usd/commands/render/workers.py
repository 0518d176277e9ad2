"""The worker processes of a run: how many, on which processors, with how much memory."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial

import psutil
from msgspec import to_builtins

from spin_usd.commands.render.destination import Destination, StartWorker
from spin_usd.commands.render.report import RunListener
from spin_usd.commands.render.supervise import WorkerLimits, supervise
from spin_usd.commands.render.task_queue import RenderTask
from spin_usd.commands.render.worker_options import WorkerOptions
from spin_usd.planning.request import RenderRequest
from spin_usd.planning.time_limit import TimeLimits
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import machine_memory, rendering_memory
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.open_renderer import renderer_entry
from spin_usd.processes.pool import ChildProtocol
from spin_usd.processes.processors import share_of, usable_cpus
from spin_usd.scene.effort import CPU
from spin_usd.stop_signals import StopRequest
from spin_usd.store.dataset_folder import Lease

MEMORY_PER_WORKER = 1 << 30  # bytes a worker is expected to need at most; 300-400 MB is usual
WORKER_MODULE = "spin_usd.commands.render.worker"  # named as text: it loads USD
HULL_MODULE = "scipy.spatial"  # for the hull of every target; it takes a third of a second to load
USUAL_SHARE, LARGEST_SHARE = 0.5, 0.9  # of the machine's memory, for all workers together


def default_workers() -> int:
    """Return as many as there are processors and memory for."""
    return max(1, min(len(usable_cpus()), psutil.virtual_memory().available // MEMORY_PER_WORKER))


class WorkerProcesses:
    """Starts the workers of a run into the `destination` under its `lease`.

    The first of this machine can be started ahead, before anybody knows what it is to do: a renderer loads for longer
    than a few pictures are planned.
    """

    def __init__(self, destination: Destination, lease: Lease, request: RenderRequest) -> None:
        self.destination, self._lease = destination, lease
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
        return self.destination.start(options, self._lease, workers) or partial(self._start, options, workers)

    def _start(self, options: WorkerOptions, workers: int, number: int) -> Child:
        child, self._ahead = self._ahead or self._process(), None
        with suppress(ChildDiedError):  # the end of its answers says so too
            child.send("open_worker", options=to_builtins(options), cpus=share_of(number, workers))
        return child

    def _process(self) -> Child:
        lease = self._lease
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
