"""A child started ahead is given once, and ended where nobody takes it."""

import psutil
import pytest

from spin_usd.processes.ask_child import ask_child
from spin_usd.processes.child_ahead import child_ahead, next_child
from spin_usd.processes.open_renderer import TRY_RENDERER

pytestmark = pytest.mark.children


def test_the_first_who_asks_gets_the_child_that_was_started_ahead() -> None:
    before = _children()
    with child_ahead(TRY_RENDERER):
        started = _children() - before
        with next_child() as first, next_child() as second:
            assert {first.process.pid} == started
            assert second.process.pid not in started


def test_a_child_that_nobody_takes_ends_with_the_block() -> None:
    before = _children()
    with child_ahead(TRY_RENDERER):
        assert len(_children() - before) == 1
    assert _children() <= before


def test_one_question_takes_it() -> None:
    before = _children()
    with child_ahead(TRY_RENDERER):
        assert "embree" in ask_child(TRY_RENDERER, "raycast", reads="nothing")
        assert _children() <= before


def _children() -> set[int]:
    return {child.pid for child in psutil.Process().children()}
