"""Many calls shared out among a few children, with their results in order."""

from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from spin_usd.basics.progress import Progress
from spin_usd.errors import SpinError
from spin_usd.processes.child import Child
from spin_usd.processes.child_ahead import next_child
from spin_usd.processes.child_limits import PATIENCE_S
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError, Retries
from spin_usd.processes.pool import Answered, Failed, Pool, Reported

AHEAD = 64  # calls for each child that may be done before the first that is not


class Call(NamedTuple):
    """A call to a child, by its name, with its arguments."""

    name: str
    arguments: Mapping[str, Any]


def results_of(
    calls: Sequence[Call],
    children: int,
    *,
    progress: Progress,
    start: Callable[[], Child] = next_child,
    within_s: float = PATIENCE_S,
) -> Iterator[Any]:
    """Yield the result of each call, in their order: a SpinError where it failed, which is a ChildDiedError where a
    child died of it, and another after it.

    `progress` hears what the children report. `start` starts a child, which is given up where it says nothing for
    `within_s` seconds. Raises ChildInternalError for a defect of ours.
    """
    with Pool[int]() as pool:
        shared = _SharedCalls(calls, pool, progress, start, within_s)
        for number in range(min(children, len(calls))):
            pool.add(number, start())
        for place in range(len(calls)):
            yield shared.result(place)


class _SharedCalls:
    """The calls that wait, those that children do, and the results that nobody has taken."""

    def __init__(
        self,
        calls: Sequence[Call],
        pool: Pool[int],
        progress: Progress,
        start: Callable[[], Child],
        within_s: float,
    ) -> None:
        self._calls, self._pool, self._progress = calls, pool, progress
        self._start, self._within_s = start, within_s
        self._waiting = deque(range(len(calls)))
        self._doing: dict[int, int] = {}  # place of the call by the child's number
        self._retries = defaultdict[int, Retries](lambda: Retries(READING_TRIES))
        self._results: dict[int, Any] = {}

    def result(self, place: int) -> Any:
        """Wait for the result of the call at that place."""
        while place not in self._results:
            self._share_out(place + AHEAD * len(self._pool))
            for event in self._pool.wait():
                self._hear(event)
        return self._results.pop(place)

    def _share_out(self, before: int) -> None:
        for number in self._pool.idle():
            if self._waiting and self._waiting[0] < before:
                place = self._doing[number] = self._waiting.popleft()
                call = self._calls[place]
                self._pool.send(number, call.name, within_s=self._within_s, **call.arguments)

    def _hear(self, event: Reported[int] | Answered[int] | Failed[int]) -> None:
        match event:
            case Reported(message=message):
                self._progress(*message)
            case Answered(key=number, result=result):
                self._results[self._doing.pop(number)] = result
            case Failed(key=number, reason=ChildDiedError() as died):
                place = self._doing.pop(number)
                self._pool.add(number, self._start())
                if self._retries[place].may_try_again(died):
                    self._waiting.appendleft(place)
                else:
                    self._results[place] = died
            case Failed(key=number, reason=SpinError() as error):
                self._results[self._doing.pop(number)] = error
            case Failed(reason=defect):
                raise defect
