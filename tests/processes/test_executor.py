"""An executor of real children: answers in order, deaths, interrupts, and what is forgotten."""

import threading
import time
from typing import Any

import psutil
import pytest

import spin_usd.processes.executor
from spin_usd.errors import InputError, SpinError
from spin_usd.processes.child import Child
from spin_usd.processes.deaths import READING_TRIES, ChildDiedError
from spin_usd.processes.executor import Executor, done_in_order
from spin_usd.processes.open_renderer import TRY_RENDERER
from spin_usd.processes.task import Task

pytestmark = pytest.mark.children


def tasks(*names):
    return [Task(call=TRY_RENDERER, request=name, tries=READING_TRIES) for name in names]


def kill_children() -> None:
    for child in psutil.Process().children():
        child.kill()


def test_tasks_end_in_their_order() -> None:
    first, second, third = done_in_order(tasks("raycast", "no such", "raycast"), 2)
    assert "embreex" in first.result
    assert isinstance(second.failure, InputError)
    assert third.result == first.result


def test_a_task_of_which_children_die_fails_by_their_death() -> None:
    """Every child that appears is killed until the task has failed."""
    ended = threading.Event()

    def kill() -> None:
        while not ended.wait(0.05):
            kill_children()

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        (task,) = done_in_order(tasks("raycast"), 1)
    finally:
        ended.set()
        killer.join()
    assert isinstance(task.failure, ChildDiedError)


def test_a_child_that_dies_once_is_replaced() -> None:
    """It is killed as soon as it appears."""

    def kill() -> None:
        while not (children := psutil.Process().children()):
            time.sleep(0.01)
        children[0].kill()

    killer = threading.Thread(target=kill)
    killer.start()
    first, second = done_in_order(tasks("raycast", "no such"), 1)
    killer.join()  # or it would kill what a later test starts
    assert "embreex" in first.result
    assert isinstance(second.failure, InputError)


class _InterruptError(BaseException):
    """What Ctrl-C raises, wherever that is."""


def test_an_interrupted_task_is_forgotten_and_its_answer_meets_no_other(monkeypatch) -> None:
    with Executor[None]() as executor:
        executor.call(TRY_RENDERER, "raycast")
        first, second = tasks("no such", "raycast")
        executor.submit(first)
        wait = executor._crew._pool.wait

        def interrupted(**how) -> None:
            list(wait(**how))  # its answer may be read already
            raise _InterruptError

        monkeypatch.setattr(executor._crew._pool, "wait", interrupted)
        with pytest.raises(_InterruptError):
            executor.wait(first)
        monkeypatch.setattr(executor._crew._pool, "wait", wait)
        assert "embreex" in executor.result(executor.submit(second))
        assert not first.ended


def test_where_no_worker_opens_the_task_fails_and_the_next_is_tried_anew() -> None:
    """An opening that is refused is one task's failure, or is raised where none waits."""

    def start(_):
        child = Child()
        child.send(TRY_RENDERER, names.pop(0))
        return child

    names = ["no such", "no such", "raycast"]
    with Executor(start, opening=TRY_RENDERER) as executor:
        with pytest.raises(InputError, match="no such"):
            executor.opened_content()
        with pytest.raises(InputError, match="no such"):
            executor.call(TRY_RENDERER, "raycast")
        assert "embreex" in executor.call(TRY_RENDERER, "raycast")
        assert "embreex" in executor.opened_content()


def test_each_task_may_try_as_often_to_open_a_worker() -> None:
    """Deaths while starting count for the task that waited, not for later ones."""
    started = []

    def start(_):
        child = Child()
        child.process.kill()
        child.send(TRY_RENDERER, "raycast")
        started.append(child)
        return child

    counts = []
    with Executor(start, opening=TRY_RENDERER) as executor:
        for _ in range(2):
            with pytest.raises(SpinError, match="no worker can be started"):
                executor.call(TRY_RENDERER, "raycast")
            counts.append(len(started))
    assert counts[1] == 2 * counts[0] > 2


@pytest.mark.timeout(60)
def test_an_interrupt_after_an_answer_was_read_loses_no_task(monkeypatch) -> None:
    with Executor[None](workers=2) as executor:
        pair = [executor.submit(task) for task in tasks("no such", "no such")]
        wait = executor._crew._pool.wait

        def interrupted(**how):
            for _ in wait(**how):
                raise _InterruptError
            return ()

        monkeypatch.setattr(executor._crew._pool, "wait", interrupted)
        with pytest.raises(_InterruptError):
            executor.wait(*tasks("never submitted"))
        monkeypatch.setattr(executor._crew._pool, "wait", wait)
        for task in pair:
            executor.wait(task)


def test_an_interrupt_from_another_thread_ends_the_wait_until_a_restart() -> None:
    with Executor[None]() as executor:
        executor.interrupt()
        (task,) = tasks("raycast")
        with pytest.raises(ChildDiedError, match="interrupted"):
            executor.wait(executor.submit(task))
        executor.restart()
        assert "embreex" in executor.call(TRY_RENDERER, "raycast")


def test_far_tasks_are_submitted_once_those_before_them_are_done(monkeypatch) -> None:
    monkeypatch.setattr(spin_usd.processes.executor, "AHEAD", 2)
    given = tasks(*["no such"] * 5)
    with Executor[None]() as executor:
        submitted: list[Task[Any]] = []
        submit = executor.submit

        def noted(task):
            submitted.append(task)
            return submit(task)

        monkeypatch.setattr(executor, "submit", noted)
        for place, done in enumerate(executor.in_order(given)):
            assert done is given[place]
            assert submitted == given[: place + 2]
