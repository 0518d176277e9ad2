"""A crew of real children: no more than there is room for, and none once nothing waits."""

from collections import deque
from typing import Any

import pytest

from spin_usd.errors import InputError
from spin_usd.processes.child import Child
from spin_usd.processes.crew import Crew
from spin_usd.processes.open_renderer import TRY_RENDERER
from spin_usd.processes.task import Done, GivenUp, Task

pytestmark = pytest.mark.children

QUICK = "no such"  # renderer, which a child refuses at once


class Source(deque[Task[Any]]):
    """Tasks that any worker may get."""

    def take(self, worker):
        return self.popleft() if self else None

    put_back = deque.appendleft


def crew_of(tasks, *, slots, started, opening=None, lasting=False):
    def start(number):
        started.append(number)
        child = Child()
        if opening:
            child.send(opening, QUICK)
        return child

    return Crew(start, tasks, slots=lambda: slots, opening=opening, lasting=lasting)


def events_of(crew):
    """Yield all events until no task waits or is being done."""
    while crew.busy:
        yield from crew.step()


def quick(count):
    return Source(Task(call=TRY_RENDERER, request=QUICK) for _ in range(count))


def test_workers_are_as_many_as_slots_and_end_with_the_tasks() -> None:
    started: list[int] = []
    most = 0
    with crew_of(quick(5), slots=2, started=started) as crew:
        events = []
        for event in events_of(crew):
            most = max(most, len(crew))
            events.append(event)
        assert not len(crew)
        assert not crew.busy
    assert started == [0, 1]
    assert most == 2
    assert [type(event) for event in events] == [GivenUp] * 5
    assert all(event.task.ended and isinstance(event.reason, InputError) for event in events)


def test_lasting_workers_wait_for_tasks_to_come() -> None:
    tasks, started = quick(1), list[int]()
    with crew_of(tasks, slots=3, started=started, lasting=True) as crew:
        list(events_of(crew))
        (worker,) = crew.idle
        assert not crew.busy
        tasks.append(Task(call=TRY_RENDERER, request="raycast"))
        assert crew.busy
        (done,) = events_of(crew)
        assert isinstance(done, Done)
        assert done.worker is worker
        crew.end(worker)
        crew.end(worker)  # again does nothing
        assert not len(crew)
    assert started == [0]


def test_a_worker_that_cannot_open_is_given_up_without_a_task_and_ends() -> None:
    tasks, started = quick(1), list[int]()
    with crew_of(tasks, slots=1, started=started, opening=TRY_RENDERER) as crew:
        given_up = next(events_of(crew))
        assert isinstance(given_up, GivenUp)
        assert given_up.task is None
        assert isinstance(given_up.reason, InputError)
        assert not len(crew)
    assert len(tasks) == 1
