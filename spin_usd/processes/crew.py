"""A crew: workers that get tasks until none is left, whatever happens to one of them.

This is the one loop that feeds a pool, and the one place that decides whether a task is tried again after a worker
died of it.
"""

from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from itertools import count, islice
from typing import Any, Generic, Self

from spin_usd.errors import RenderError, SpinError
from spin_usd.processes import pool
from spin_usd.processes.call import Call
from spin_usd.processes.child import ChildInternalError
from spin_usd.processes.child_limits import START_PATIENCE_S
from spin_usd.processes.deaths import ChildDiedError, Retries
from spin_usd.processes.patience import LOOK_S
from spin_usd.processes.pool import ChildProtocol, Pool
from spin_usd.processes.task import Done, Event, GivenUp, Opened, T, Tasks, Worker, WorkerReport


class Crew(Generic[T]):
    """Workers that do the tasks of a source. All that are left are killed when the crew's block ends."""

    def __init__(
        self,
        start: Callable[[int], ChildProtocol],
        tasks: Tasks[T],
        *,
        slots: Callable[[], int],
        opening: Call[Any, Any] | None = None,
        memory: int | None = None,
        lasting: bool = False,
    ) -> None:
        """`start`: starts a child by its number; with `opening` it was already sent that call. `slots`: the current
        limit of the number of workers. `memory`: bytes beyond which a busy worker is killed. `lasting`: idle workers
        wait for tasks; otherwise they end."""
        self._start, self._tasks, self._slots = start, tasks, slots
        self._opening, self._lasting = opening, lasting
        self._pool = Pool[Worker[T]](memory=memory)
        self._events = deque[Event[T]]()
        self._while_starting = defaultdict[int, Retries](Retries)  # since the last task that was done

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.__exit__()

    def __len__(self) -> int:
        return len(self._pool)

    def fileno(self) -> int:
        """Readable when a worker has sent a message."""
        return self._pool.fileno()

    @property
    def busy(self) -> bool:
        """Whether a task waits or is being done."""
        return bool(len(self._tasks) or self.tasks or self._events)

    @property
    def workers(self) -> list[Worker[T]]:
        """All workers."""
        return list(self._pool)

    @property
    def idle(self) -> list[Worker[T]]:
        """The workers that wait for a task."""
        return [worker for worker in self._pool.idle() if worker.opened]

    @property
    def tasks(self) -> list[T]:
        """The tasks that are being done."""
        return [worker.task for worker in self._pool if worker.task]

    def step(self, *, within_s: float = LOOK_S) -> Iterator[Event[T]]:
        """Start workers, give them tasks, wait that long at most for messages, and yield the events. An event whose
        handling is interrupted comes again."""
        if not self._events:
            self.start_workers()
            self._give_tasks()
            self._listen(within_s)
        while self._events:
            event = self._events[0]
            yield event
            if self._events and self._events[0] is event:  # else its handling has ended all workers
                self._events.popleft()
        self.start_workers()
        self._give_tasks()

    def give(self, worker: Worker[T], within_s: float) -> None:
        """Give a worker so many seconds from now for its next message."""
        self._pool.give(worker, within_s)

    def end(self, worker: Worker[T]) -> None:
        """End a worker at once; another takes its place while tasks wait."""
        if worker in self._pool:
            self._pool.kill(worker)

    def clear(self) -> None:
        """End all workers at once."""
        for worker in self._pool:
            self._pool.kill(worker)
        self._events.clear()
        self._while_starting.clear()

    def interrupt(self) -> None:
        """End all workers, from another thread than the one that steps, which learns of their death."""
        self._pool.interrupt()

    def start_workers(self) -> None:
        """Start workers while there is work and room for them; if there is none, let idle workers end."""
        starting = [worker for worker in self._pool if not worker.opened]
        if not len(self._tasks) and not self._lasting:
            for worker in starting:
                self._pool.kill(worker)
            for worker in self.idle:
                self._pool.close(worker)
        ready = len(starting) + len(self.idle)
        taken = {worker.number for worker in self._pool}
        free = (number for number in count() if number not in taken)
        for number in islice(free, max(0, min(self._slots() - len(taken), len(self._tasks) - ready))):
            opened = self._opening is None
            within_s = None if opened else START_PATIENCE_S
            self._pool.add(Worker(number=number, opened=opened), self._start(number), within_s=within_s)

    def _give_tasks(self) -> None:
        for worker in self.idle:
            if task := self._tasks.take(worker):
                worker.task, task.begun = task, True
                self._pool.send(worker, task.call, task.request, within_s=task.within_s)

    def _listen(self, within_s: float) -> None:
        """Take the messages of workers. If this is interrupted, busy workers end, as half an answer may have been read,
        and their tasks wait again."""
        try:
            for event in list(self._pool.wait(within_s=within_s)):
                self._events.extend(self._heard(event))
        except BaseException:
            for worker in self._pool:
                if worker.task:
                    self._tasks.put_back(worker.task)
                if worker.task or not worker.opened:
                    self._pool.kill(worker)
            raise

    def _heard(self, event: pool.PoolEvent[Worker[T]]) -> Iterator[Event[T]]:
        worker = event.key
        match event:
            case pool.Reported(message=message):
                yield WorkerReport(worker=worker, task=worker.task, message=message)
            case pool.Answered(result=result) if not worker.opened:
                assert self._opening
                worker.opened = True
                yield Opened(worker=worker, answer=self._opening.decoded(result))
            case pool.Answered(result=result):
                assert worker.task
                task, worker.task = worker.task, None
                self._while_starting.clear()
                task.finish(result)
                yield Done(worker=worker, task=task)
            case pool.Failed(reason=reason):
                yield from self._failed(worker, reason)

    def _failed(self, worker: Worker[T], reason: SpinError | ChildInternalError) -> Iterator[Event[T]]:
        """Try a task again after the death of its worker, unless too many have died."""
        task, worker.task = worker.task, None
        if isinstance(reason, ChildDiedError):
            retries = task.retries if task else self._while_starting[worker.number]
            if retries.may_try_again(reason):
                if task:
                    self._tasks.put_back(task)
                return
            words = retries.in_words(reason)
            if not task:
                del self._while_starting[worker.number]  # the next task may try as often
            reason = ChildDiedError(words, cause=reason.cause) if task else no_worker(words)
        elif not worker.opened:
            self._pool.kill(worker)
        if task:
            task.fail(reason)
        yield GivenUp(worker=worker, task=task, reason=reason)


def no_worker(why: str) -> RenderError:
    """Return the error for workers that cannot be opened."""
    return RenderError(f"no worker can be started: {why}", do="run spin-usd doctor")
