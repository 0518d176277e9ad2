"""The processes of a measurement: a few, each with one renderer, fed job by job; a crash ends one job."""

import selectors
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Self

from spin_usd.dataset.process.child import HANG_S, Child, ChildDiedError, ChildInternalError
from spin_usd.errors import OutputError, RenderError, SpinError


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A process: its renderer, and how that is opened (see process.open_renderer)."""

    renderer: str
    crop: bool = True


@dataclass(frozen=True, kw_only=True)
class Job:
    """What a process of that kind is asked: see the methods of worker.MeasuringWorker."""

    kind: Kind
    what: str
    arguments: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Of a job: what came of it, or why nothing did."""

    result: Any = None
    failed: str | None = None


@dataclass(kw_only=True, eq=False)
class _Process:
    """A child and how it was started; whether it is still being opened."""

    child: Child
    kind: Kind
    opening: bool = True


@dataclass(kw_only=True, eq=False)
class _Slot:
    """The place of one process at work and of others that wait, one of each renderer; `job`: the number of what the one
    is at."""

    number: int
    processes: dict[str, _Process] = field(default_factory=dict)
    job: int | None = None

    def end(self, renderer: str) -> None:
        if renderer in self.processes:
            self.processes.pop(renderer).child.kill()


class Pool:
    """`count` processes at work at most. `start(number, kind)` starts one that was already sent what opens it. No word
    from any for `hang_s` seconds is taken for a hang."""

    def __init__(self, count: int, start: Callable[[int, Kind], Child], *, hang_s: float = HANG_S) -> None:
        self._start, self.hang_s = start, hang_s
        self._slots = [_Slot(number=number) for number in range(count)]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for slot in self._slots:
            for renderer in list(slot.processes):
                slot.end(renderer)

    def run(self, jobs: Sequence[Job], told: Callable[[Any], None] = lambda word: None) -> list[Answer]:
        """Do the jobs, in their order as processes become free; what came of each. `told` hears what they tell
        meanwhile. Raises OutputError where results cannot be written, and what opening a process raises."""
        answers: dict[int, Answer] = {}
        waiting = deque(range(len(jobs)))
        with selectors.DefaultSelector() as selector:
            for slot in self._slots:
                self._feed(slot, waiting, jobs, selector)
            while busy := [key.data for key in selector.get_map().values()]:
                ready = [key.data for key, _ in selector.select(timeout=self.hang_s)]
                for slot in ready or busy:
                    job = jobs[slot.job]
                    process = slot.processes[job.kind.renderer]
                    if not ready:
                        process.child.process.kill()
                    if answer := _answer(process, told):
                        answers[slot.job] = answer
                        selector.unregister(process.child)
                        if answer.failed is not None:
                            slot.end(job.kind.renderer)
                        self._feed(slot, waiting, jobs, selector)
        return [answers[number] for number in range(len(jobs))]

    def _feed(self, slot: _Slot, waiting: "deque[int]", jobs: Sequence[Job], selector: selectors.BaseSelector) -> None:
        """Give a free slot the next job, for a process of its kind."""
        slot.job = waiting.popleft() if waiting else None
        if slot.job is None:
            return
        job = jobs[slot.job]
        process = slot.processes.get(job.kind.renderer)
        if process is None or process.kind != job.kind:
            slot.end(job.kind.renderer)
            process = _Process(child=self._start(slot.number, job.kind), kind=job.kind)
            slot.processes[job.kind.renderer] = process
        selector.register(process.child, selectors.EVENT_READ, slot)
        with suppress(ChildDiedError):  # its end is readable too, and is dealt with there
            process.child.send("measure", what=job.what, **job.arguments)


def _answer(process: _Process, told: Callable[[Any], None]) -> Answer | None:
    """What came of the process's job; None where that is not done."""
    try:
        for word in process.child.received():
            if "progress" in word:
                told(*word["progress"])
            elif process.opening:
                process.opening = False
            else:
                return Answer(result=word["result"])
    except (SpinError, ChildInternalError) as reason:
        if process.opening and isinstance(reason, ChildDiedError):
            raise RenderError(f"no process can be started: {reason.found}", do="run spin-usd doctor") from reason
        if process.opening or isinstance(reason, OutputError):
            raise
        return Answer(failed=str(reason))
    return None
