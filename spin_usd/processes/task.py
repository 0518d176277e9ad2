"""The tasks of a crew, their source, and the events that a crew reports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar, cast

from spin_usd.errors import SpinError
from spin_usd.processes.call import Answer, Call
from spin_usd.processes.child import ChildInternalError
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.deaths import TRIES, DeathCause, Retries


@dataclass(kw_only=True, eq=False)
class Task(Generic[Answer]):
    """A call for a worker to answer, and its result."""

    call: Call[Any, Answer]
    request: Any
    within_s: float = PATIENCE_S
    """Seconds for each message from the worker, as Patience counts them."""
    tries: Mapping[DeathCause, int] = field(default_factory=lambda: TRIES)
    """Deaths of each cause after which it has failed."""
    progress: Callable[..., None] | None = None
    """Called with the progress that the worker reports."""
    failure: SpinError | ChildInternalError | None = None
    """Reason of its failure."""
    begun: bool = False
    """True once a worker got it."""
    ended: bool = False
    """True once it is done or has failed."""

    def __post_init__(self) -> None:
        self.retries = Retries(self.tries)
        self._answer: Answer | None = None

    @property
    def result(self) -> Answer:
        """The answer. Raises the failure."""
        if self.failure is not None:
            raise self.failure
        return cast(Answer, self._answer)

    def finish(self, answer: object) -> None:
        """Take the answer as JSON."""
        self._answer, self.ended = self.call.decoded(answer), True

    def fail(self, reason: SpinError | ChildInternalError) -> None:
        """Take the failure."""
        self.failure, self.ended = reason, True


T = TypeVar("T", bound=Task[Any])


@dataclass(kw_only=True, eq=False)
class Worker(Generic[T]):
    """A child of a crew."""

    number: int
    """Its place among the workers, from 0; one that replaces another has the same."""
    opened: bool
    """Whether the child is ready for tasks."""
    task: T | None = None
    """Task in work."""
    holds: object = None
    """Note of the tasks' source on the worker's state, such as an open variant."""


class Tasks(Protocol[T]):
    """The source of a crew's tasks, which decides their order."""

    def __len__(self) -> int:
        """Return how many tasks wait, for workers that are idle or still to be started."""

    def take(self, worker: Worker[T]) -> T | None:
        """Return the next task for this idle worker; None if it has to wait."""

    def put_back(self, task: T) -> None:
        """Take back a task that is to be tried again."""


@dataclass(frozen=True, kw_only=True)
class Opened(Generic[T]):
    """A worker is ready; `answer` is its answer to the opening call."""

    worker: Worker[T]
    answer: Any


@dataclass(frozen=True, kw_only=True)
class WorkerReport(Generic[T]):
    """A worker reports progress on a task, or while it opens."""

    worker: Worker[T]
    task: T | None
    message: Sequence[Any]
    """Arguments of a callback."""


@dataclass(frozen=True, kw_only=True)
class Done(Generic[T]):
    """A task is done; the task has the answer."""

    worker: Worker[T]
    task: T


@dataclass(frozen=True, kw_only=True)
class GivenUp(Generic[T]):
    """A task has failed, or, without one, no worker can be opened. A ChildDiedError names the last of the deaths."""

    worker: Worker[T]
    task: T | None
    reason: SpinError | ChildInternalError


Event = Opened[T] | WorkerReport[T] | Done[T] | GivenUp[T]
