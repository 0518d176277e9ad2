"""Calls to a crew of lasting workers, in the manner of concurrent.futures: submitted, waited for, or forgotten.

An answer belongs to its task alone: an interrupted caller forgets the task, and never gets its answer afterwards.
"""

from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, Generic, Self, TypeVar

from spin_usd.errors import SpinError
from spin_usd.processes.ask_child import unreadable
from spin_usd.processes.call import Answer, Call, Request
from spin_usd.processes.child import ChildInternalError, in_process
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.crew import Crew
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError, DeathCause
from spin_usd.processes.patience import LOOK_S
from spin_usd.processes.pool import ChildProtocol
from spin_usd.processes.task import Done, GivenUp, Opened, Task, Worker, WorkerReport

AHEAD = 64  # tasks that each worker may do ahead of the next one taken

Content = TypeVar("Content")


class _Waiting:
    """The waiting tasks, and whether to start a worker before there is one; `prepare` is called with each task
    taken."""

    def __init__(self, prepare: Callable[[Task[Any]], None]) -> None:
        self.tasks, self._prepare = deque[Task[Any]](), prepare
        self.wants_worker = False

    def __len__(self) -> int:
        return max(len(self.tasks), self.wants_worker)

    def take(self, worker: Worker[Task[Any]]) -> Task[Any] | None:
        if not self.tasks:
            return None
        task = self.tasks.popleft()
        self._prepare(task)
        return task

    def put_back(self, task: Task[Any]) -> None:
        self.tasks.appendleft(task)


class Executor(Generic[Content]):
    """Does tasks in at most `workers` processes, which stay until the block ends.

    `start`: starts a child by its number, a plain one if not given; with `opening` it was already sent that call.
    """

    def __init__(
        self,
        start: Callable[[int], ChildProtocol] = lambda _: next_child(),
        *,
        workers: int = 1,
        opening: Call[Any, Content] | None = None,
    ) -> None:
        self.workers = 1 if in_process() else workers  # Blender's state is the process's
        self._waiting = _Waiting(self._prepare)
        self._crew = Crew[Task[Any]](start, self._waiting, slots=lambda: self.workers, opening=opening, lasting=True)
        self._content: Content | None = None
        self._interrupted = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the workers at once."""
        self._crew.__exit__()
        self._waiting.tasks.clear()

    def fileno(self) -> int:
        """Readable when a worker has sent a message."""
        return self._crew.fileno()

    def start(self) -> None:
        """Start a worker unless there is one, without waiting for it."""
        self._waiting.wants_worker = not len(self._crew)
        self._crew.start_workers()

    def opened_content(self) -> Content:
        """Start a worker, and return its answer to the opening call. Raises the errors of opening it."""
        self.start()
        while self._content is None:
            self.step()
        return self._content

    def submit(self, task: Task[Answer], *, first: bool = False) -> Task[Answer]:
        """Add a task, `first` before all others that wait, and return it."""
        if first:
            self._waiting.tasks.appendleft(task)
        else:
            self._waiting.tasks.append(task)
        return task

    def call(
        self,
        call: Call[Request, Answer],
        request: Request,
        *,
        within_s: float = PATIENCE_S,
        reads: object = None,
        progress: Callable[..., None] | None = None,
    ) -> Answer:
        """Return the answer to a call, whose progress the child reports. Raises the errors of the child; if children
        die, the error of `unreadable` on the file that it `reads`, or ChildDiedError without one."""
        task = Task(call=call, request=request, within_s=within_s, tries=READING_TRIES, progress=progress)
        self.submit(task)
        try:
            return self.result(task)
        except ChildDiedError as died:
            if reads is None:
                raise
            raise unreadable(died, reads) from died

    def result(self, task: Task[Answer]) -> Answer:
        """Wait for a task, and return its answer. Raises its failure."""
        self.wait(task)
        return task.result

    def wait(self, task: Task[Any]) -> None:
        """Wait until a task is done or has failed; where that is interrupted, forget it."""
        try:
            while not task.ended:
                if self._interrupted:
                    raise ChildDiedError("the worker process was interrupted", cause=DeathCause.KILLED)
                self.step()
        except BaseException:
            self.forget([task])
            raise

    def in_order(self, tasks: Sequence[Task[Answer]]) -> Iterator[Task[Answer]]:
        """Do the tasks, and yield each once it is done or has failed, in their order. Raises ChildInternalError for a
        defect of ours."""
        most = AHEAD * self.workers
        for place, task in enumerate(tasks):
            for coming in tasks[:most] if place == 0 else tasks[place + most - 1 : place + most]:
                self.submit(coming)
            self.wait(task)
            if isinstance(task.failure, ChildInternalError):
                raise task.failure
            yield task

    def forget(self, tasks: Collection[Task[Any]]) -> None:
        """Drop these tasks if they wait; discard the answers of the others."""
        self._waiting.tasks = deque(task for task in self._waiting.tasks if task not in tasks)

    def forget_all(self) -> None:
        """Drop all tasks, and end the workers that are at one."""
        self._waiting.tasks.clear()
        for worker in self._crew.workers:
            if worker.task:
                self._crew.end(worker)

    def step(self, *, within_s: float = LOOK_S) -> None:
        """Give idle workers the tasks that wait, and take their answers, waiting that long for them. Raises the reason
        where no worker can be opened and no task waits."""
        refused = None
        for event in self._crew.step(within_s=within_s):
            match event:
                case Opened(answer=answer):
                    self._content, self._waiting.wants_worker = answer, False
                    self._opened(answer)
                case Done(worker=worker, task=task):
                    self._done(worker, task)
                case WorkerReport(task=Task(progress=progress), message=message) if progress:
                    progress(*message)
                case GivenUp(task=None, reason=reason):
                    refused = self._refused(reason)
                case GivenUp() | WorkerReport():
                    pass
        if refused:  # not before: an event whose handling is interrupted comes again
            raise refused

    def interrupt(self) -> None:
        """End the workers, from another thread than the one that waits for a task: it gets ChildDiedError, and so does
        any later wait, until `restart`."""
        self._interrupted = True
        self._crew.interrupt()

    def restart(self) -> None:
        """End the workers, and start another."""
        self._crew.clear()
        self._interrupted = False
        self.start()

    def _opened(self, answer: Content) -> None:
        """Take a worker's answer to the opening call."""

    def _prepare(self, task: Task[Any]) -> None:
        """Prepare a task that a worker is about to get."""

    def _done(self, worker: Worker[Task[Any]], task: Task[Any]) -> None:
        """Take a worker's result, before it gets another task."""

    def _refused(self, reason: SpinError | ChildInternalError) -> SpinError | ChildInternalError | None:
        """Let the first task that waits fail, as no worker can be opened; return the reason if none waits."""
        self._waiting.wants_worker = False
        if not self._waiting.tasks:
            return reason
        self._waiting.tasks.popleft().fail(reason)
        return None


def done_in_order(
    tasks: Sequence[Task[Answer]], workers: int, *, start: Callable[[int], ChildProtocol] = lambda _: next_child()
) -> Iterator[Task[Answer]]:
    """Do the tasks in `workers` processes of their own, as Executor.in_order does."""
    with Executor[None](start, workers=workers) as executor:
        yield from executor.in_order(tasks)
