"""The processes of a measurement: a few, each with one renderer, that get tasks; a crash ends one task."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

from spin_usd.commands.measure.calls import OPEN_MEASURING, OpenMeasuring
from spin_usd.commands.measure.renders import RenderStore
from spin_usd.errors import OutputError, SpinError
from spin_usd.planning.make_plan import Plan
from spin_usd.processes.call import Answer, Call, Request
from spin_usd.processes.child import Child
from spin_usd.processes.child_limits import rendering_memory
from spin_usd.processes.deaths import ChildDiedError
from spin_usd.processes.executor import Executor
from spin_usd.processes.processors import share_of
from spin_usd.processes.task import Task
from spin_usd.store.dataset_folder import Lease


@dataclass(frozen=True, kw_only=True)
class ProcessKind:
    """The renderer of a process, and its opening (see processes.open_renderer)."""

    renderer: str
    crop: bool = True


class Processes:
    """At most `count` processes at work, of one kind at a time; others wait. `start(kind, number)` starts one that was
    already sent OPEN_MEASURING; a busy one that sends nothing for `within_s` seconds is killed."""

    def __init__(self, count: int, start: Callable[[ProcessKind, int], Child], *, within_s: float) -> None:
        self._count, self._start, self.within_s = count, start, within_s
        self._executors: dict[ProcessKind, Executor[None]] = {}
        self._held = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: Any) -> None:
        self._held.close()

    def run(
        self,
        kind: ProcessKind,
        call: Call[Request, Answer],
        requests: Sequence[Request],
        on_made: Callable[[str], None] | None = None,
    ) -> list[Answer | SpinError]:
        """Do the calls in their order as processes of that kind become free; return each answer, or why it failed.

        `on_made` is called with the key of each render as it is made. Raises OutputError if results cannot be written,
        and the errors of opening a process.
        """
        if kind not in self._executors:
            executor = Executor(partial(self._start, kind), workers=self._count, opening=OPEN_MEASURING)
            self._executors[kind] = self._held.enter_context(executor)
        tasks = [Task(call=call, request=each, within_s=self.within_s, progress=on_made) for each in requests]
        answers: list[Answer | SpinError] = []
        for task in self._executors[kind].in_order(tasks):
            failure = task.failure
            if failure is not None and (isinstance(failure, OutputError) or not task.begun):
                raise failure
            answers.append(failure if isinstance(failure, SpinError) else task.result)
        return answers


def start_process(plan: Plan, runs: RenderStore, lease: Lease, count: int, kind: ProcessKind, number: int) -> Child:
    """Start a process of that kind, the `number`th of `count`."""
    writes = (runs.root, runs.work)
    child = Child(keep_open=(lease.descriptor,), scratch=lease.work, memory=rendering_memory(), writes=writes)
    request = OpenMeasuring(
        stage=str(plan.root),
        variant=plan.variants[0],
        folder=str(runs.root),
        work=str(runs.work),
        cpus=share_of(number, count),
        renderer=kind.renderer,
        crop=kind.crop,
    )
    with suppress(ChildDiedError):  # the end of its answers reports it too
        child.send(OPEN_MEASURING, request)
    return child
