"""The processes of a measurement: a few, each with one renderer, fed job by job; a crash ends one job."""

from collections import defaultdict, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Self

from spin_usd.commands.measure.renders import RenderStore
from spin_usd.errors import OutputError, RenderError
from spin_usd.planning.make_plan import Plan
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import START_PATIENCE_S, rendering_memory
from spin_usd.processes.deaths import ChildDiedError, Retries
from spin_usd.processes.pool import Answered, Failed, Pool, Reported
from spin_usd.processes.processors import share_of
from spin_usd.store.dataset_folder import Lease


@dataclass(frozen=True, kw_only=True)
class ProcessKind:
    """The renderer of a process, and how that is opened (see process.open_renderer)."""

    renderer: str
    crop: bool = True


@dataclass(frozen=True, kw_only=True)
class Job:
    """The method `what` of worker.MeasuringWorker that a process of that kind is to call."""

    kind: ProcessKind
    what: str
    arguments: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class JobResult:
    """The result of a job, or why it failed."""

    result: Any = None
    failed: str | None = None


@dataclass(kw_only=True, eq=False)
class _Slot:
    """The place of one process at work and of others that wait, one of each renderer."""

    number: int
    processes: dict[str, "_Process"] = field(default_factory=dict)


@dataclass(kw_only=True, eq=False)
class _Process:
    """One process, whether it is still being opened, and the job that it is at, with the job's number."""

    slot: _Slot
    kind: ProcessKind
    opening: bool = True
    job: tuple[int, Job] | None = None


class Processes:
    """`count` processes at work at most. `start(number, kind)` starts one that was already sent what opens it; one at
    work that says nothing for `within_s` seconds is killed. The job of one that died is tried again."""

    def __init__(self, count: int, start: Callable[[int, ProcessKind], Child], *, within_s: float) -> None:
        self._start, self.within_s, self.pool = start, within_s, Pool[_Process]()
        self._slots = [_Slot(number=number) for number in range(count)]

    def __enter__(self) -> Self:
        self.pool.__enter__()
        return self

    def __exit__(self, *raised: object) -> None:
        self.pool.__exit__(*raised)

    def run(self, jobs: Sequence[Job], on_made: Callable[[str], None] = lambda key: None) -> list[JobResult]:
        """Do the jobs, in their order as processes become free; return what came of each.

        `on_made` is called with the key of each render as it is made. Raises OutputError where results cannot be
        written, and what opening a process raises.
        """
        results: dict[int, JobResult] = {}
        retries = defaultdict[int, Retries](Retries)
        waiting = deque(enumerate(jobs))
        for slot in self._slots:
            self._feed(slot, waiting)
        while len(results) < len(jobs):
            for event in self.pool.wait():
                process = event.key
                if isinstance(event, Reported):
                    on_made(*event.message)
                elif job := process.job:
                    if isinstance(event, Answered) and process.opening:
                        process.opening = False
                        self._send(process, job[1])
                    elif (died := _death(event)) and retries[job[0]].may_try_again(died):
                        self._forget(process)
                        waiting.appendleft(job)
                        self._feed(process.slot, waiting)
                    else:
                        results[job[0]] = self._ended(event)
                        self._feed(process.slot, waiting)
                elif isinstance(event, Failed):
                    self._forget(process)
        return [results[number] for number in range(len(jobs))]

    def _feed(self, slot: _Slot, waiting: "deque[tuple[int, Job]]") -> None:
        """Give a free slot the next job, for a process of its kind."""
        if not waiting:
            return
        number, job = waiting.popleft()
        process = slot.processes.get(job.kind.renderer)
        if process and process.kind != job.kind:
            self._forget(process)
            process = None
        if process:
            process.job = number, job
            self._send(process, job)
        else:
            process = _Process(slot=slot, kind=job.kind, job=(number, job))
            slot.processes[job.kind.renderer] = process
            self.pool.add(process, self._start(slot.number, job.kind), within_s=START_PATIENCE_S)

    def _send(self, process: _Process, job: Job) -> None:
        self.pool.send(process, "measure", within_s=self.within_s, what=job.what, **job.arguments)

    def _ended(self, event: Answered[_Process] | Failed[_Process]) -> JobResult:
        """Return what came of a process's job; a process whose job failed is ended."""
        process = event.key
        process.job = None
        if isinstance(event, Answered):
            return JobResult(result=event.result)
        if process.opening and isinstance(event.reason, ChildDiedError):
            found = f"no process can be started: {event.reason.found}"
            raise RenderError(found, do="run spin-usd doctor") from event.reason
        if process.opening or isinstance(event.reason, OutputError):
            raise event.reason
        self._forget(process)
        return JobResult(failed=str(event.reason))

    def _forget(self, process: _Process) -> None:
        """End a process; it may be dead already."""
        del process.slot.processes[process.kind.renderer]
        if process in self.pool:
            self.pool.kill(process)


def _death(event: Answered[_Process] | Failed[_Process]) -> ChildDiedError | None:
    """Return how the process died; None where it lives."""
    return event.reason if isinstance(event, Failed) and isinstance(event.reason, ChildDiedError) else None


def start_process(plan: Plan, runs: RenderStore, lease: Lease, count: int, number: int, kind: ProcessKind) -> Child:
    """Start a process of that kind, the `number`th of `count`."""
    child = Child(keep_open=(lease.descriptor,), scratch=lease.work, memory=rendering_memory())
    child.send(
        "open_measuring",
        stage=str(plan.root),
        variant=plan.variants[0],
        folder=str(runs.root),
        work=str(runs.work),
        cpus=share_of(number, count),
        **asdict(kind),
    )
    return child
