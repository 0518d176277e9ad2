"""A pool of real children: their answers, their deaths and their hangs."""

from collections.abc import Iterator
from typing import Any

import pytest

from spin_usd.processes.child import Child
from spin_usd.processes.deaths import ChildDiedError, DeathCause
from spin_usd.processes.open_renderer import TRY_RENDERER
from spin_usd.processes.pool import Answered, Failed, Pool

pytestmark = pytest.mark.children


@pytest.fixture
def pool() -> Iterator[Pool[Any]]:
    with Pool[Any]() as pool:
        yield pool


def events(pool, count):
    found: list[Any] = []
    while len(found) < count:
        found += pool.wait()
    return found


def test_each_answer_is_known_by_its_child(pool) -> None:
    for key in ("one", "two"):
        pool.add(key, Child())
        pool.send(key, TRY_RENDERER, "raycast", within_s=60.0)
    assert pool.idle() == []
    answers = events(pool, 2)
    assert {event.key for event in answers} == {"one", "two"}
    assert all(isinstance(event, Answered) and "embreex" in event.result for event in answers)
    assert pool.idle() == ["one", "two"]


def test_a_child_that_fails_stays_and_one_that_dies_goes(pool) -> None:
    child = Child()
    pool.add("one", child)
    pool.send("one", TRY_RENDERER, "povray", within_s=60.0)
    (failed,) = events(pool, 1)
    assert isinstance(failed, Failed)
    assert "povray" in str(failed.reason)
    assert "one" in pool
    child.process.kill()
    (died,) = events(pool, 1)
    assert isinstance(died.reason, ChildDiedError)
    assert "SIGKILL" in died.reason.found
    assert len(pool) == 0


def test_what_is_sent_to_a_dead_child_is_answered_by_its_death(pool) -> None:
    child = Child()
    pool.add("one", child)
    child.process.kill()
    child.process.wait()
    pool.send("one", TRY_RENDERER, "raycast", within_s=60.0)
    (died,) = events(pool, 1)
    assert isinstance(died.reason, ChildDiedError)


def test_only_a_child_at_work_can_hang(pool) -> None:
    working, waiting = Child(), Child()
    pool.add("working", working, within_s=0.1)
    pool.add("waiting", waiting)
    (hung,) = events(pool, 1)
    assert hung.key == "working"
    assert "processor time" in hung.reason.found
    assert working.process.poll() is not None
    assert pool.idle() == ["waiting"]


def test_children_end_with_their_pool() -> None:
    child = Child()
    with Pool[Any]() as pool:
        pool.add("one", child, within_s=60.0)
    assert child.process.poll() is not None


def test_a_child_at_work_that_grows_is_ended() -> None:
    with Pool[Any](memory=1 << 20) as pool:
        pool.add("waiting", Child())
        pool.add("working", Child(), within_s=60.0)
        (event,) = events(pool, 1)
        assert (event.key, event.reason.cause) == ("working", DeathCause.GREW)
        assert "more than its 0.0 GiB" in event.reason.found
        assert "waiting" in pool


def test_a_word_gives_a_child_its_time_again(pool) -> None:
    """Two pieces of work, each within its time, take longer together."""
    pool.add("one", Child())
    pool.send("one", TRY_RENDERER, "raycast", within_s=0.01)
    pool.give("one", 60.0)
    (answer,) = events(pool, 1)
    assert isinstance(answer, Answered)
